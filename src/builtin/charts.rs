//! Which chart of the atlas each triangle belongs to: seams run where they show least.

use std::collections::BTreeMap;

use glam::DVec3;

use super::head::Head;
use super::surface::Surface;

/// The charts, in the order of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(super) enum Chart {
    Face,
    Scalp,
    Throat,
    Back,
    Floor,
    EarFrontLeft,
    EarFrontRight,
    EarBackLeft,
    EarBackRight,
}

impl Chart {
    pub(super) const ALL: [Self; 9] = [
        Self::Face,
        Self::Scalp,
        Self::Throat,
        Self::Back,
        Self::Floor,
        Self::EarFrontLeft,
        Self::EarFrontRight,
        Self::EarBackLeft,
        Self::EarBackRight,
    ];

    /// Texels spent on a length, relative to the other charts: most where one looks.
    pub(super) const fn density(self) -> f64 {
        match self {
            Self::Face => 1.0,
            Self::EarFrontLeft | Self::EarFrontRight => 1.5,
            Self::EarBackLeft | Self::EarBackRight => 1.0,
            Self::Scalp => 0.6,
            Self::Throat => 0.55,
            Self::Back => 0.42,
            Self::Floor => 0.15,
        }
    }

    fn of(head: &Head, metres: DVec3, normal: DVec3) -> Self {
        let p = Head::anatomical(metres);
        let left = p.x > 0.0;
        let half = DVec3::new(p.x.abs(), p.y, p.z);
        if head.ear.bound(half) < 0.0 && head.without_ears(half) > 0.22 {
            let outward = DVec3::new(normal.x.abs() * (normal.x * p.x).signum(), normal.y, normal.z);
            return match (head.ear.outward(outward) > -0.25, left) {
                (true, true) => Self::EarFrontLeft,
                (true, false) => Self::EarFrontRight,
                (false, true) => Self::EarBackLeft,
                (false, false) => Self::EarBackRight,
            };
        }
        if p.y < -23.0 && normal.y < -0.7 {
            return Self::Floor;
        }
        let jawline = if p.z > 0.0 { -6.3 - 0.62 * p.z } else { -6.3 };
        match (p.y < jawline, p.z) {
            (true, z) if z > -1.4 => Self::Throat,
            (true, _) => Self::Back,
            (false, z) if z > 1.4 - 0.14 * (p.y + 1.75) => Self::Face,
            _ => Self::Scalp,
        }
    }
}

/// A chart for every triangle; each chart is connected.
pub(super) fn assign(head: &Head, surface: &Surface) -> Vec<Chart> {
    let mut charts: Vec<Chart> = surface
        .triangles
        .iter()
        .map(|t| {
            let mean = |of: &[DVec3]| t.iter().map(|&i| of[i as usize]).sum::<DVec3>() / 3.0;
            Chart::of(head, mean(&surface.positions), mean(&surface.normals))
        })
        .collect();
    let neighbours = neighbours(&surface.triangles);
    for _ in 0..6 {
        smooth_borders(&mut charts, &neighbours);
    }
    for _ in 0..4 {
        absorb_islands(&mut charts, &neighbours);
    }
    charts
}

/// The triangles across the sides of each triangle.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut sides: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            sides.entry((a.min(b), a.max(b))).or_default().push(i as u32);
        }
    }
    let mut neighbours = vec![Vec::new(); triangles.len()];
    for owners in sides.values() {
        for &a in owners {
            neighbours[a as usize].extend(owners.iter().copied().filter(|&b| b != a));
        }
    }
    neighbours
}

/// A triangle with two neighbours in one other chart joins it: straightens the seams.
fn smooth_borders(charts: &mut [Chart], neighbours: &[Vec<u32>]) {
    for i in 0..charts.len() {
        let own = neighbours[i].iter().filter(|&&j| charts[j as usize] == charts[i]).count();
        for &j in &neighbours[i] {
            let other = charts[j as usize];
            let votes = neighbours[i].iter().filter(|&&k| charts[k as usize] == other).count();
            if votes >= 2 && votes > own {
                charts[i] = other;
            }
        }
    }
}

/// Every part of a chart but its largest joins the chart that it touches most.
fn absorb_islands(charts: &mut [Chart], neighbours: &[Vec<u32>]) {
    let mut seen = vec![false; charts.len()];
    let mut parts: BTreeMap<Chart, Vec<Vec<usize>>> = BTreeMap::new();
    for start in 0..charts.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut part = vec![start];
        let mut next = 0;
        while next < part.len() {
            for &j in &neighbours[part[next]] {
                let j = j as usize;
                if !seen[j] && charts[j] == charts[start] {
                    seen[j] = true;
                    part.push(j);
                }
            }
            next += 1;
        }
        parts.entry(charts[start]).or_default().push(part);
    }
    for (chart, mut parts) in parts {
        parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
        for part in parts.into_iter().skip(1) {
            let mut touching = BTreeMap::new();
            for &i in &part {
                for &j in &neighbours[i] {
                    *touching.entry(charts[j as usize]).or_insert(0_usize) += 1;
                }
            }
            touching.remove(&chart);
            if let Some((&into, _)) = touching.iter().max_by_key(|&(_, count)| *count) {
                for i in part {
                    charts[i] = into;
                }
            }
        }
    }
}
