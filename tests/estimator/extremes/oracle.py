"""The paper's formulas as printed, with tan and cot, in mpmath; no formula is shared with the package."""

import mpmath as mp

mp.mp.dps = 70  # 50 digits remain after the differences that make κ


def phi_of(beta, alpha):
    return max(mp.mpf(0), beta - alpha)


def m_z(d_x, theta, beta, alpha, C):  # (13)
    return C * theta / d_x / (mp.tan(beta) * mp.tan(phi_of(beta, alpha)) + 1)


def m_y(d_x, theta, beta, alpha, C):  # (14)
    phi = phi_of(beta, alpha)
    return C * theta / d_x / (mp.tan(beta) + mp.cot(phi)) if phi else mp.mpf(0)


def magnitude(*arguments):
    return mp.sqrt(m_y(*arguments) ** 2 + m_z(*arguments) ** 2)


def slid(d_x, theta, beta, alpha):  # (5)
    phi = phi_of(beta, alpha)
    return d_x * theta / (mp.sin(beta) + mp.cos(beta) * mp.cot(phi)) if phi else mp.mpf(0)


def known_slope(theta, y, z, beta, C):  # (6)
    return C * theta / (z + y * mp.tan(beta))


def assumed_friction(theta, y, z, alpha, C):  # (8), (9), (10)
    return C * theta / (z + y * mp.tan(mp.atan(y / z) + alpha))


def cone(theta, y, z, alpha, C, length):  # (17) at the scaled angle
    phi = mp.atan(y / z)
    scaled = theta * mp.cos(phi + alpha) / mp.cos(alpha)
    return C * scaled * length / (C * scaled + mp.sqrt(y * y + z * z) * length)


def cone_printed(theta, y, z, C, length):  # (17)
    m = mp.sqrt(y * y + z * z)
    return C * theta * length / (C * theta + m * length) * z / m


def circle(r_n, theta, beta):  # (25)–(28), (32)
    y_c, z_c = r_n * mp.cos(beta), r_n * mp.sin(beta)
    return y_c, z_c, mp.atan2(z_c, y_c - theta), mp.sqrt((y_c - theta) ** 2 + z_c**2)


def appendix_b(r_n, theta, beta, alpha, printed):  # (24), (31)
    _, _, zeta, p = circle(r_n, theta, beta)
    exact = zeta - mp.asin(r_n * mp.sin(alpha) / p) if beta > alpha else mp.mpf(0)
    phi = max(mp.mpf(0), zeta - alpha) if printed else exact
    d = mp.sqrt(r_n**2 - p**2 / 2 * (1 - mp.cos(2 * (zeta - phi)))) - p * mp.cos(zeta - phi)
    return phi, d


def two_distances(c_1, c_2, shift, C):  # section VII, with k_theta = d/C + 1/(k d²) at both places
    def excess(d):
        return (C * c_1 - d) * d**2 - (C * c_2 - d - shift) * (d + shift) ** 2

    a = [excess(mp.mpf(i)) for i in range(3)]
    square = (a[2] - 2 * a[1] + a[0]) / 2
    linear = a[1] - a[0] - square
    root = mp.sqrt(linear**2 - 4 * square * a[0])
    return max((-linear + root) / (2 * square), (-linear - root) / (2 * square))
