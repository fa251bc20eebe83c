//! Joins polygons that a file has cut along the 180th meridian, as RFC 7946 section 3.1.9 asks. Otherwise the halves
//! would leave a gap of zero width between them, through which a route could pass. A polygon round a pole, which is cut
//! along the meridian and over the pole, is joined to itself.

use std::collections::HashMap;
use std::iter::successors;

/// Degrees east and north.
type Corner = [f64; 2];

/// A part of a ring between two places on the meridian.
struct Chain {
    /// Index of its ring.
    ring: usize,
    corners: Vec<Corner>,
}

/// Outer rings of one geometry, each with the index of its first source ring. Rings that continue each other across
/// the meridian are joined; all others are unchanged.
pub(super) fn joined(rings: &[Vec<Corner>]) -> Vec<(usize, Vec<Corner>)> {
    let chains: Vec<Chain> = rings
        .iter()
        .enumerate()
        .flat_map(|(index, ring)| chains(index, &counterclockwise(ring)))
        .collect();
    let follower = followers(&chains);
    let mut whole = whole(rings.len(), &chains, &follower);
    let mut made: Vec<(usize, Vec<Corner>)> = Vec::new();
    let mut told = vec![false; chains.len()];
    for first in 0..chains.len() {
        if told[first] || !whole[chains[first].ring] {
            continue;
        }
        let mut ring: Vec<Corner> = Vec::new();
        let mut next = Some(first);
        while let Some(index) = next.filter(|index| !told[*index]) {
            told[index] = true;
            // A chain begins where the one before ends.
            ring.extend(&chains[index].corners[1..]);
            next = follower[index];
        }
        if ring.len() > 2 {
            made.push((chains[first].ring, ring));
        } else {
            // A band as wide as the earth, which has no other corners.
            whole[chains[first].ring] = false;
        }
    }
    let others = rings.iter().cloned().enumerate();
    made.extend(others.filter(|(index, _)| !whole[*index]));
    made.sort_by_key(|(index, _)| *index);
    made
}

/// The ring in counter-clockwise order, without repeated first corner.
fn counterclockwise(ring: &[Corner]) -> Vec<Corner> {
    let mut ring = ring.to_vec();
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    let next = ring.iter().cycle().skip(1);
    let twice_area: f64 = ring
        .iter()
        .zip(next)
        .map(|(a, b)| (a[0] - b[0]) * (a[1] + b[1]))
        .sum();
    if twice_area < 0.0 {
        ring.reverse();
    }
    ring
}

/// A ring without its edges along the meridian, and along it over a pole; empty if it has no such edge.
fn chains(ring: usize, corners: &[Corner]) -> Vec<Chain> {
    let n = corners.len();
    let is_cut = |index: usize| {
        let (here, next) = (corners[index % n], corners[(index + 1) % n]);
        let is_at_pole = here[1].abs() >= 90.0 && next[1].abs() >= 90.0;
        here[0].abs() >= 180.0
            && next[0].abs() >= 180.0
            && (is_at_pole || here[0].total_cmp(&next[0]).is_eq())
    };
    let Some(cut) = (0..n).find(|index| is_cut(*index)) else {
        return Vec::new();
    };
    let mut chains = Vec::new();
    let mut corners_so_far = Vec::new();
    // Once around, from the end of one cut to the beginning of the last.
    for index in cut + 1..=cut + n {
        corners_so_far.push(corners[index % n]);
        if is_cut(index) {
            let corners = std::mem::take(&mut corners_so_far);
            // Two cuts in a row have nothing between them.
            if corners.len() > 1 {
                chains.push(Chain { ring, corners });
            }
        }
    }
    chains
}

/// For each chain, the one that begins where it ends, on the other side.
fn followers(chains: &[Chain]) -> Vec<Option<usize>> {
    let place = |[lon, lat]: Corner, beyond: bool| {
        let is_east = lon < 0.0;
        // Both zeros are the same latitude.
        (is_east != beyond, (lat + 0.0).to_bits())
    };
    let mut begins = HashMap::new();
    for (index, chain) in chains.iter().enumerate() {
        begins.insert(place(chain.corners[0], false), index);
    }
    let mut taken = vec![false; chains.len()];
    let follower = |chain: &Chain| {
        let end = chain.corners[chain.corners.len() - 1];
        let next = *begins.get(&place(end, true))?;
        (!std::mem::replace(&mut taken[next], true)).then_some(next)
    };
    chains.iter().map(follower).collect()
}

/// Which rings have a successor for every chain, in every ring of their group.
fn whole(n_rings: usize, chains: &[Chain], follower: &[Option<usize>]) -> Vec<bool> {
    let mut group: Vec<usize> = (0..n_rings).collect();
    for (chain, next) in chains.iter().zip(follower) {
        if let Some(next) = next {
            let (one, other) = (
                head(&mut group, chain.ring),
                head(&mut group, chains[*next].ring),
            );
            group[one] = other;
        }
    }
    let mut whole = vec![false; n_rings];
    for chain in chains {
        whole[chain.ring] = true;
    }
    let mut broken = vec![false; n_rings];
    for (chain, next) in chains.iter().zip(follower) {
        broken[head(&mut group, chain.ring)] |= next.is_none();
    }
    for ring in 0..n_rings {
        whole[ring] &= !broken[head(&mut group, ring)];
    }
    whole
}

/// The representative of a ring's group.
fn head(group: &mut [usize], ring: usize) -> usize {
    let path: Vec<usize> =
        successors(Some(ring), |at| Some(group[*at]).filter(|next| next != at)).collect();
    let head = path[path.len() - 1];
    for at in path {
        group[at] = head;
    }
    head
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(rings: &[&[Corner]], expected: &[(usize, &[Corner])]) {
        let rings: Vec<Vec<Corner>> = rings.iter().map(|ring| ring.to_vec()).collect();
        let expected: Vec<(usize, Vec<Corner>)> = expected
            .iter()
            .map(|(index, ring)| (*index, ring.to_vec()))
            .collect();
        assert_eq!(joined(&rings), expected);
    }

    const WEST: [Corner; 5] = [
        [179.0, 0.0],
        [180.0, 0.0],
        [180.0, 2.0],
        [179.0, 2.0],
        [179.0, 0.0],
    ];
    const EAST: [Corner; 4] = [[-180.0, 0.0], [-179.0, 0.0], [-179.0, 2.0], [-180.0, 2.0]];
    const BOTH: [Corner; 6] = [
        [179.0, 2.0],
        [179.0, 0.0],
        [180.0, 0.0],
        [-179.0, 0.0],
        [-179.0, 2.0],
        [-180.0, 2.0],
    ];

    #[test]
    fn halves_are_one_however_they_turn() {
        check(&[&WEST, &EAST], &[(0, &BOTH)]);
        let mut clockwise = EAST;
        clockwise.reverse();
        check(&[&WEST, &clockwise], &[(0, &BOTH)]);
    }

    #[test]
    fn what_ends_at_the_meridian_is_as_it_was() {
        let far = [[170.0, 0.0], [171.0, 0.0], [171.0, 1.0]];
        check(&[&far, &WEST], &[(0, &far), (1, &WEST)]);
        let lower = [[-180.0, 0.0], [-179.0, 0.0], [-180.0, 1.0]];
        check(&[&WEST, &lower], &[(0, &WEST), (1, &lower)]);
        let touching = [[180.0, 5.0], [179.0, 6.0], [179.0, 4.0]];
        check(&[&WEST, &touching, &EAST], &[(0, &BOTH), (1, &touching)]);
    }

    /// Two arms cross the meridian; our own exports write the cut part as one ring that touches itself.
    #[test]
    fn two_arms_across_are_arms_of_one() {
        let body = [
            [178.0, 0.0],
            [180.0, 0.0],
            [180.0, 1.0],
            [179.0, 1.0],
            [179.0, 2.0],
            [180.0, 2.0],
            [180.0, 3.0],
            [178.0, 3.0],
        ];
        let arms = [
            [-180.0, 0.0],
            [-179.0, 0.0],
            [-179.0, 1.0],
            [-180.0, 1.0],
            [-180.0, 2.0],
            [-179.0, 2.0],
            [-179.0, 3.0],
            [-180.0, 3.0],
        ];
        let expected = [
            [179.0, 1.0],
            [179.0, 2.0],
            [180.0, 2.0],
            [-179.0, 2.0],
            [-179.0, 3.0],
            [-180.0, 3.0],
            [178.0, 3.0],
            [178.0, 0.0],
            [180.0, 0.0],
            [-179.0, 0.0],
            [-179.0, 1.0],
            [-180.0, 1.0],
        ];
        check(&[&body, &arms], &[(0, &expected)]);
        let apart: [&[Corner]; 3] = [&arms[..4], &body, &arms[4..]];
        assert_eq!(joined(&apart.map(<[Corner]>::to_vec)).len(), 1);
    }

    /// Our own exports close a ring round a pole over it.
    #[test]
    fn a_ring_round_a_pole_is_not_cut() {
        let cap = [
            [-180.0, 88.0],
            [-120.0, 88.0],
            [0.0, 89.0],
            [120.0, 88.0],
            [180.0, 88.0],
            [180.0, 90.0],
            [-180.0, 90.0],
            [-180.0, 88.0],
        ];
        check(&[&cap], &[(0, &cap[1..5])]);
        let south = cap.map(|[lon, lat]| [-lon, -lat]);
        check(&[&south], &[(0, &south[1..5])]);
    }

    /// A band that is as wide as the earth has no corners but those of its cuts.
    #[test]
    fn a_band_all_round_is_as_it_was() {
        let band = [[-180.0, 80.0], [180.0, 80.0], [180.0, 90.0], [-180.0, 90.0]];
        check(&[&band], &[(0, &band)]);
    }
}
