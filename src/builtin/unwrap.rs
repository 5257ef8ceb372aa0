//! A chart laid flat: Tutte's embedding, which never folds, then made as rigid as possible.
//!
//! W. Tutte, *How to Draw a Graph*, 1963; L. Liu et al., *A Local/Global Approach to Mesh
//! Parameterization*, 2008.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

/// Rounds of the local/global iteration.
const RIGID_ROUNDS: usize = 60;

/// Flat coordinates, in the unit of `positions`, of a connected patch with a border; triangles are
/// counter-clockwise in (s, t), t upwards.
pub(super) fn flatten(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec2> {
    let border = longest_border(triangles);
    let mut flat = embed(positions, triangles, &border);
    let corners: Vec<[DVec2; 3]> =
        triangles.iter().map(|t| laid_out(t.map(|i| positions[i as usize]))).collect();
    let area = |t: [DVec2; 3]| 0.5 * (t[1] - t[0]).perp_dot(t[2] - t[0]);
    let wanted: f64 = corners.iter().map(|&t| area(t)).sum();
    let found: f64 = triangles.iter().map(|t| area(t.map(|i| flat[i as usize])).abs()).sum();
    let scale = (wanted / found.max(f64::MIN_POSITIVE)).sqrt();
    flat.iter_mut().for_each(|p| *p *= scale);
    relax(triangles, &corners, &mut flat);
    unfold(triangles, &border, &mut flat);
    flat
}

/// Rounds of unfolding.
const UNFOLD_ROUNDS: usize = 400;

/// Where triangles came out folded (in creases too deep to lie flat), draw their vertices to the
/// mean of their neighbours, Tutte's rule, until none is left.
fn unfold(triangles: &[[u32; 3]], border: &[u32], flat: &mut [DVec2]) {
    let neighbours = weights(flat.len(), triangles, |_, _| 1.0);
    let mut held = vec![false; flat.len()];
    border.iter().for_each(|&v| held[v as usize] = true);
    for round in 0..UNFOLD_ROUNDS {
        let mut loose = vec![false; flat.len()];
        for t in triangles {
            let [a, b, c] = t.map(|i| flat[i as usize]);
            let (area, longest) =
                ((b - a).perp_dot(c - a), (b - a).length_squared().max((c - a).length_squared()));
            // Slivers count as folded: a texel could not be told from its neighbour there.
            if area <= 0.02 * longest {
                t.iter().for_each(|&i| loose[i as usize] = true);
            }
        }
        if !loose.contains(&true) {
            break;
        }
        // The longer it takes, the farther around.
        for _ in 0..1 + round / 40 {
            let seeds: Vec<usize> = (0..flat.len()).filter(|&i| loose[i]).collect();
            seeds.iter().flat_map(|&i| &neighbours[i]).for_each(|&(j, _)| loose[j as usize] = true);
        }
        for i in 0..flat.len() {
            if loose[i] && !held[i] {
                let sum: DVec2 = neighbours[i].iter().map(|&(j, _)| flat[j as usize]).sum();
                flat[i] = sum / neighbours[i].len() as f64;
            }
        }
    }
}

/// A triangle in its own plane.
fn laid_out([a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    let base = (b - a).length();
    let x = (b - a) / base.max(f64::MIN_POSITIVE);
    let along = (c - a).dot(x);
    [DVec2::ZERO, DVec2::new(base, 0.0), DVec2::new(along, ((c - a) - x * along).length())]
}

/// The border's longest loop, in the triangles' direction.
fn longest_border(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut sides: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            *sides.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &(a, b) in sides.keys() {
        if !sides.contains_key(&(b, a)) {
            next.entry(a).or_default().push(b);
        }
    }
    let mut longest = Vec::new();
    while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
        let mut walk = vec![start];
        while let Some(to) = next.get_mut(walk.last().unwrap_or(&start)).and_then(Vec::pop) {
            // A walk that comes back to itself has closed a loop: split it off there.
            if let Some(at) = walk.iter().position(|&v| v == to) {
                let ring = walk.split_off(at);
                if ring.len() > longest.len() {
                    longest.clone_from(&ring);
                }
                walk.push(to);
            } else {
                walk.push(to);
            }
        }
    }
    longest
}

/// Each vertex with its neighbours and their weights; the weights are symmetric and positive.
type Weights = Vec<Vec<(u32, f64)>>;

fn weights(count: usize, triangles: &[[u32; 3]], of: impl Fn(usize, usize) -> f64) -> Weights {
    let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *sums.entry((a.min(b), a.max(b))).or_insert(0.0) += of(i, k);
        }
    }
    let mut weights = vec![Vec::new(); count];
    for ((a, b), w) in sums {
        weights[a as usize].push((b, w));
        weights[b as usize].push((a, w));
    }
    weights
}

/// The border on a circle, every other vertex at the mean of its neighbours.
fn embed(positions: &[DVec3], triangles: &[[u32; 3]], border: &[u32]) -> Vec<DVec2> {
    let mut flat = vec![DVec2::ZERO; positions.len()];
    let mut free = vec![1.0; positions.len()];
    let side = |i: usize| {
        let (a, b) = (border[i], border[(i + 1) % border.len()]);
        positions[a as usize].distance(positions[b as usize])
    };
    let around: f64 = (0..border.len()).map(side).sum();
    let mut gone = 0.0;
    for (i, &v) in border.iter().enumerate() {
        flat[v as usize] = DVec2::from_angle(std::f64::consts::TAU * gone / around);
        free[v as usize] = 0.0;
        gone += side(i);
    }
    let weights = weights(positions.len(), triangles, |_, _| 1.0);
    solve(&weights, &free, &vec![DVec2::ZERO; positions.len()], &mut flat, 3000);
    flat
}

/// Solve sum_j w_ij (x_i - x_j) = b_i for the free vertices by conjugate gradients with Jacobi's
/// preconditioner, from the x that is given.
fn solve(weights: &Weights, free: &[f64], b: &[DVec2], x: &mut [DVec2], most: usize) {
    let apply = |x: &[DVec2], i: usize| -> DVec2 {
        weights[i].iter().map(|&(j, w)| (x[i] - x[j as usize]) * w).sum::<DVec2>() * free[i]
    };
    let diagonal: Vec<f64> =
        weights.iter().map(|row| row.iter().map(|&(_, w)| w).sum::<f64>().max(f64::MIN_POSITIVE)).collect();
    // The two coordinates are two systems with one matrix: every product is kept by coordinate.
    let dot = |a: &[DVec2], b: &[DVec2]| a.iter().zip(b).map(|(&a, &b)| a * b).sum::<DVec2>();
    let ratio = |a: DVec2, b: DVec2| DVec2::select(b.cmpgt(DVec2::ZERO), a / b, DVec2::ZERO);
    let mut r: Vec<DVec2> = (0..x.len()).map(|i| b[i] * free[i] - apply(x, i)).collect();
    let mut z: Vec<DVec2> = r.iter().zip(&diagonal).map(|(&r, d)| r / *d).collect();
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let goal = rz * 1e-14;
    for _ in 0..most {
        if rz.cmple(goal).all() {
            break;
        }
        let ap: Vec<DVec2> = (0..x.len()).map(|i| apply(&p, i)).collect();
        let alpha = ratio(rz, dot(&p, &ap));
        for i in 0..x.len() {
            x[i] += alpha * p[i];
            r[i] -= alpha * ap[i];
            z[i] = r[i] / diagonal[i];
        }
        let next = dot(&r, &z);
        let beta = ratio(next, rz);
        rz = next;
        for i in 0..x.len() {
            p[i] = z[i] + beta * p[i];
        }
    }
}

/// Turn each triangle rigidly to fit its place, fit the vertices to the turned triangles, repeat.
fn relax(triangles: &[[u32; 3]], corners: &[[DVec2; 3]], flat: &mut [DVec2]) {
    // Cotangents, kept above a floor so that the system stays definite on obtuse triangles.
    let cotangent = |i: usize, k: usize| {
        let t = &corners[i];
        let (u, v) = (t[k] - t[(k + 2) % 3], t[(k + 1) % 3] - t[(k + 2) % 3]);
        0.5 * (u.dot(v) / u.perp_dot(v).max(1e-12)).clamp(0.05, 20.0)
    };
    let weights = weights(flat.len(), triangles, cotangent);
    let free = vec![1.0; flat.len()];
    let mut b = vec![DVec2::ZERO; flat.len()];
    for _ in 0..RIGID_ROUNDS {
        b.fill(DVec2::ZERO);
        for (i, t) in triangles.iter().enumerate() {
            // The best rotation in the plane is the angle of sum w conj(from) to.
            let mut turn = DVec2::ZERO;
            for k in 0..3 {
                let (from, to) = (
                    corners[i][(k + 1) % 3] - corners[i][k],
                    flat[t[(k + 1) % 3] as usize] - flat[t[k] as usize],
                );
                turn += cotangent(i, k) * DVec2::new(from.dot(to), from.perp_dot(to));
            }
            let turn = turn.normalize_or(DVec2::X);
            for k in 0..3 {
                let (a, c) = (t[k] as usize, t[(k + 1) % 3] as usize);
                let side = turn.rotate(corners[i][(k + 1) % 3] - corners[i][k]) * cotangent(i, k);
                b[a] -= side;
                b[c] += side;
            }
        }
        solve(&weights, &free, &b, flat, 80);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of squares, each cut in two, lifted by `shape`.
    fn sheet(shape: impl Fn(f64, f64) -> DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        const N: u32 = 17;
        let at = |i: u32| f64::from(i) / f64::from(N - 1);
        let positions = (0..N * N).map(|i| shape(at(i % N), at(i / N))).collect();
        let mut triangles = Vec::new();
        for y in 0..N - 1 {
            for x in 0..N - 1 {
                let i = y * N + x;
                triangles.extend([[i, i + 1, i + N + 1], [i, i + N + 1, i + N]]);
            }
        }
        (positions, triangles)
    }

    #[test]
    fn a_sheet_rolled_up_is_unrolled_to_its_own_lengths() {
        let (positions, triangles) = sheet(|x, y| DVec3::new(x.sin(), y, 1.0 - x.cos()));
        let flat = flatten(&positions, &triangles);
        for t in &triangles {
            for k in 0..3 {
                let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                let (here, there) = (flat[a].distance(flat[b]), positions[a].distance(positions[b]));
                // Sixty rounds of the iteration come within a percent.
                assert!((here - there).abs() < 0.01 * there, "{here} for {there}");
            }
        }
    }

    #[test]
    fn a_dome_lies_flat_without_a_fold() {
        let (positions, triangles) = sheet(|x, y| {
            let (u, v) = (2.0 * x - 1.0, 2.0 * y - 1.0);
            DVec3::new(u, v, 1.5 * (1.0 - u * u) * (1.0 - v * v))
        });
        let flat = flatten(&positions, &triangles);
        for t in &triangles {
            let [a, b, c] = t.map(|i| flat[i as usize]);
            assert!((b - a).perp_dot(c - a) > 0.0);
        }
    }
}
