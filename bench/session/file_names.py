"""Names of the files that state a session and a trial."""

SESSION_TOML = "session.toml"
TRIAL_TOML = "trial.toml"
