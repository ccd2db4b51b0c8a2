"""Compares two pictures that were drawn by different programs: they are equal up to one pixel at edges."""

import numpy

# Programs cover the pixels along edges differently: a line of one pixel may lie in one row or be spread over two.
AT_EDGES = 48
ELSEWHERE = 6


def neighbours(picture):
    """Returns the nine pictures that are shifted by at most one pixel."""
    padded = numpy.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = picture.shape[:2]
    return [padded[y:y + height, x:x + width] for y in range(3) for x in range(3)]


def share_unlike(first, second):
    """Returns the share of the pixels whose colour does not occur within one pixel in the other picture. A colour occurs if
    each channel lies between the least and the greatest value there. Pixels whose neighbours have their colour, and which
    therefore lie away from edges, must agree more closely."""
    assert first.shape == second.shape, (first.shape, second.shape)
    unlike = numpy.zeros(first.shape[:2], bool)
    for one, other in ((first, second), (second, first)):
        near = neighbours(other)
        low, high = numpy.minimum.reduce(near), numpy.maximum.reduce(near)
        own = neighbours(one)
        at_edge = (numpy.maximum.reduce(own) - numpy.minimum.reduce(own)).max(axis=2) > 16
        beyond = numpy.maximum(low - one, one - high).max(axis=2)
        unlike |= beyond > numpy.where(at_edge, AT_EDGES, ELSEWHERE)
    return unlike.mean()
