"""OMPL's asymptotically optimal planners on the plane of a scenario, for length only."""

import math

PLANNERS = {"OMPL Informed RRT*": "InformedRRTstar", "OMPL BIT*": "BITstar"}

# Share of the area's diagonal between two checked states: under 3 m here, so a disc of 40 m is entered by 3 cm
# at most. A finer step costs OMPL much of its second.
RESOLUTION = 0.002


def length(planner, scenario, discs, seconds, seed):
    """The length of the best way found, or None."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(seed)
    space = base.RealVectorStateSpace(2)
    bounds = base.RealVectorBounds(2)
    for idx, axis in enumerate("xy"):
        bounds.setLow(idx, scenario["area"]["min"][axis])
        bounds.setHigh(idx, scenario["area"]["max"][axis])
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    squares = [(x, y, radius * radius) for x, y, radius in discs]

    def valid(state):
        x, y = state[0], state[1]
        return all((x - cx) ** 2 + (y - cy) ** 2 >= square for cx, cy, square in squares)

    setup.setStateValidityChecker(valid)
    ends = []
    for end in ("start", "target"):
        state = space.allocState()
        state[0], state[1] = scenario[end]["x"], scenario[end]["y"]
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(RESOLUTION)
    setup.setOptimizationObjective(base.PathLengthOptimizationObjective(information))
    setup.setPlanner(getattr(geometric, PLANNERS[planner])(information))
    setup.solve(seconds)
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    states = [path.getState(idx) for idx in range(path.getStateCount())]
    points = [(state[0], state[1]) for state in states]
    return sum(map(math.dist, points, points[1:]))
