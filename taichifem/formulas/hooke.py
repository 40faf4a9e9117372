"""Hooke's law for isotropic solids (slides 18 and 26)."""

from taichifem.runtime import ti


@ti.func
def stress(strain, lame_lambda, mu):
    """sigma = lambda tr(eps) I + 2 mu eps; strain (3,3) symmetric, moduli [Pa]."""
    trace = strain.trace()
    sigma = 2 * mu * strain
    for k in ti.static(range(strain.n)):
        sigma[k, k] += lame_lambda * trace
    return sigma


@ti.func
def energy_density(strain, lame_lambda, mu):
    """psi = lambda/2 tr(eps)^2 + mu eps:eps [J/m^3]."""
    trace = strain.trace()
    return 0.5 * lame_lambda * trace * trace + mu * strain.norm_sqr()


@ti.func
def stiffness_block(h_a, h_b, lame_lambda, mu):
    """K_ab / V = lambda h_a h_b^T + mu h_b h_a^T + mu (h_a . h_b) I, (3,3).

    h_a = R g_a are the rotated shape gradients, so that this is the warped stiffness R K R^T.
    """
    block = lame_lambda * h_a.outer_product(h_b) + mu * h_b.outer_product(h_a)
    shared = mu * h_a.dot(h_b)
    for k in ti.static(range(h_a.n)):
        block[k, k] += shared
    return block


@ti.func
def von_mises(sigma):
    """Equivalent stress sqrt(3/2) |dev sigma| [Pa]."""
    mean = sigma.trace() / 3
    deviator = sigma
    for k in ti.static(range(3)):
        deviator[k, k] -= mean
    return ti.sqrt(1.5 * deviator.norm_sqr())
