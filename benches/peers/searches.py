"""The peers: each spends a pricer's evaluations, starting from the straight line."""

import random


def mealpy_search(make):
    def search(pricer, seed, budget):
        import numpy
        from mealpy import FloatVar

        numpy.random.seed(seed)  # L-SHADE's scale factors come from here
        coding, population = pricer.coding, 50
        bounds = FloatVar(lb=coding.lower, ub=coding.upper)
        problem = {"bounds": bounds, "obj_func": pricer.objective, "minmax": "min", "log_to": None}
        # Slightly more than enough: the pricer ends the search when the budget is spent.
        model = make(budget // population + 2, population)
        first = numpy.array(beginning(coding, population, seed))
        model.solve(problem, seed=seed, starting_solutions=first)

    return search


def pso(epochs, population):
    from mealpy import PSO

    # Clerc and Kennedy's constriction, as weights.
    return PSO.OriginalPSO(epoch=epochs, pop_size=population, c1=1.49618, c2=1.49618, w=0.7298)


def ba(epochs, population):
    from mealpy import BA

    # Yang's frequencies; mealpy's default 0..10 throws every bat onto the bounds.
    return BA.DevBA(epoch=epochs, pop_size=population, pulse_rate=0.9, pf_min=0.0, pf_max=2.0)


def abc(epochs, population):
    from mealpy import ABC

    # Karaboga's limit is half of population times dimensions, far above mealpy's 25.
    return ABC.OriginalABC(epoch=epochs, pop_size=population, n_limits=500)


def l_shade(epochs, population):
    from mealpy import SHADE

    return SHADE.L_SHADE(epoch=epochs, pop_size=population)


def differential_evolution(pricer, seed, budget):
    import numpy
    from scipy.optimize import Bounds, NonlinearConstraint
    from scipy.optimize import differential_evolution as evolve

    coding, population = pricer.coding, 50
    seen = {}

    def priced(positions):
        """Violations and costs of columns; scipy requests the two in turn."""
        columns = [numpy.array(column) for column in numpy.reshape(positions.T, (-1, len(positions)))]
        if any(column.tobytes() not in seen for column in columns):
            seen.clear()
            seen.update(zip((column.tobytes() for column in columns), pricer.prices(columns)))
        return numpy.reshape([seen[column.tobytes()] for column in columns], (-1, 2)).T

    evolve(
        lambda x: priced(x)[1],
        Bounds(coding.lower, coding.upper),
        constraints=NonlinearConstraint(lambda x: priced(x)[:1], 0, 0),
        strategy="currenttobest1bin",
        init=numpy.array(beginning(coding, population, seed)),
        maxiter=2 * budget // population,
        tol=0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=seed,
    )


def beginning(coding, population, seed):
    """The straight line, and others scattered around it by up to the full range."""
    draw = random.Random(seed)
    members = [list(coding.straight)]
    while len(members) < population:
        reach = len(members) / population
        member = []
        for middle, low, high in zip(coding.straight, coding.lower, coding.upper):
            value = middle + reach * 0.5 * (high - low) * draw.uniform(-1, 1)
            member.append(min(max(value, low), high))
        members.append(member)
    return members


SEARCHES = {
    "mealpy PSO": mealpy_search(pso),
    "mealpy BA": mealpy_search(ba),
    "mealpy ABC": mealpy_search(abc),
    "mealpy L-SHADE": mealpy_search(l_shade),
    "scipy DE": differential_evolution,
}
