"""What the cameras see: calibrated views, the bar and the wire in space, the contact. Knows no torque."""
