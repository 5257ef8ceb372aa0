//! Blurs across the seam of two charts of a tube, beside ones that are cut there.

use super::*;
use crate::model::diffusion::Seams;
use crate::program::lower::Natives;
use crate::program::shading::Shading;
use crate::shader::Facts;
use crate::shader::facts::FaceSizes;
use crate::shader::tangent::chain::Seed;

/// A blur of what vertices hold, as wide on the surface wherever it is.
const TUBE: &str = "\
// effect: tube, light of a tube
// parameter: tube_radius = 0.4 in [0.001, 30]; standard deviation, in the scene's unit; a test
// parameter: tube_depth = 1.5 in [0.1, 10]; how bent the light is; a test
//
// gives: tube_light
// domain: texel
// cost: 12
fn tube_map(vertex_occlusion: f32, tube_depth: f32) -> vec3f {
    return vec3f(vertex_occlusion, tube_depth * vertex_occlusion * vertex_occlusion, 1.0);
}

// gives: tube_stretch
// domain: texel
// cost: 20
fn tube_stretch_map(vertex_position: vec3f) -> vec2f {
    let along: vec3f = dpdx(vertex_position);
    let down: vec3f = dpdy(vertex_position);
    return sqrt(vec2f(dot(along, along), dot(down, down)));
}

// gives: tube_soft
// domain: texel
// pass: tube_light: vec3f, 5 taps
// sampled: 0
// cost: 8
fn tube_kernel(tap: f32, axis: vec2f, tube_radius: f32, tube_stretch: vec2f) -> vec2f {
    let step: f32 = dot(tube_stretch, axis);
    return vec2f(tap * tube_radius / max(step, 1e-6), exp(-0.5 * tap * tap));
}

// gives: tube_part
// adds: tube
// cost: 1
fn tube_shown(tube_soft: vec3f) -> vec3f {
    return tube_soft;
}
";

fn tube() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("tube", TUBE).unwrap_or_else(|error| panic!("{error}")))
}

/// Facets of half the tube, each 1 wide.
const FACETS: usize = 4;
const HEIGHT: f64 = 4.0;

/// Where a place of the tube lies in the atlas: half 0 upright, half 1 lying on its side and coarser.
fn in_atlas(half: usize, along: f64, up: f64) -> Vec2 {
    let (along, up) = (along / FACETS as f64, up / HEIGHT);
    let [u, v] = if half == 0 {
        [0.06 + 0.38 * along, 0.07 + 0.86 * up]
    } else {
        [0.56 + 0.3 * up, 0.11 + 0.37 * along]
    };
    Vec2::new(u as f32, v as f32)
}

/// Half a tube of sixteen facets, bent where these meet, in two charts that have its middle as a seam; the chart of each
/// vertex, and what it holds: `light` of how far along the tube's round it is, and how far up.
fn mesh(light: impl Fn(f64, f64) -> f64) -> (PosedMesh, Vec<u32>, Vec<f32>) {
    let (mut mesh, mut charts, mut open) = (PosedMesh::default(), Vec::new(), Vec::new());
    // Corners of a regular polygon of 4 FACETS sides, each 1 long.
    let angle = std::f64::consts::TAU / (4 * FACETS) as f64;
    let radius = 0.5 / (0.5 * angle).sin();
    for half in 0..2 {
        for facet in 0..FACETS {
            let first = mesh.positions.len() as u32;
            for (side, up) in [(0, 0.0), (1, 0.0), (1, HEIGHT), (0, HEIGHT)] {
                let corner = half * FACETS + facet + side;
                let (sine, cosine) = (angle * corner as f64).sin_cos();
                mesh.positions.push(Vec3::new((radius * cosine) as f32, up as f32, (radius * sine) as f32));
                mesh.normals.push(Vec3::new(cosine as f32, 0.0, sine as f32));
                mesh.uvs.push(in_atlas(half, (facet + side) as f64, up));
                charts.push(half as u32 + 1);
                open.push(light(corner as f64, up) as f32);
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    (mesh, charts, open)
}

fn atlas(seams: Seams, light: impl Fn(f64, f64) -> f64) -> (Setup, Arc<Atlas>) {
    let mut setup = setup(&[tube()]);
    setup.choices.diffusion.seams = seams;
    let ((mesh, charts, open), rays) = (mesh(light), RayMesh::new(&[], &[]));
    let surface = PosedSurface::bare(&mesh, &rays, Some(open)).in_charts(charts);
    (setup, Arc::new(Atlas::new(&setup, &surface, &Maps::default(), 64).unwrap()))
}

fn levels(
    setup: &Setup,
    atlas: &Atlas,
    point: &Point,
    free: &[Param],
) -> std::collections::BTreeMap<String, Vec<[f64; 3]>> {
    let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
    let facts = Facts::of_samples(*setup, FaceSizes::default(), false);
    let shading = Shading::new(&facts, &seeds, |_| None, Natives::Called).unwrap();
    LevelMaker::new(shading.levels).make(atlas, &point.params, &CubesAt::dark(f64::from)).all()
}

/// How far along the tube's round and how far up a texel is.
fn place(atlas: &Atlas, texel: usize) -> [f64; 2] {
    let [u, v] = atlas.texel(texel).map(|x| (f64::from(x) + 0.5) / f64::from(atlas.size()));
    let facets = FACETS as f64;
    match atlas.chart(texel) {
        1 => [facets * (u - 0.06) / 0.38, HEIGHT * (v - 0.07) / 0.86],
        _ => [facets + facets * (v - 0.11) / 0.37, HEIGHT * (u - 0.56) / 0.3],
    }
}

/// How far the blurred light is from what it was, at most, of texels that the tube's own borders are too far from to be
/// blurred in: two deviations, and the next texel.
fn step(seams: Seams) -> f64 {
    let (setup, atlas) = atlas(seams, |along, up| 0.1 + 0.1 * along + 0.05 * up);
    let made = levels(&setup, &atlas, &start(&[]), &[]);
    let inner = (0..atlas.covered()).filter(|&texel| {
        let [along, up] = place(&atlas, texel);
        (1.2..2.0 * FACETS as f64 - 1.2).contains(&along) && (1.2..HEIGHT - 1.2).contains(&up)
    });
    let off = inner.map(|texel| (made["tube_soft"][texel][0] - made["tube_light"][texel][0]).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn linear_light_crosses_a_seam_without_a_step_where_it_is_joined() {
    // Shares and what vertices hold are f32: a few roundings of numbers below 1.
    assert!(step(Seams::Joined) < 2e-6, "{}", step(Seams::Joined));
    // Cut, a border's texel is the mean of one side: off by about half a deviation's worth of the slope.
    let cut = step(Seams::Cut);
    assert!((0.01..0.04).contains(&cut), "{cut}");
}

#[test]
fn a_constant_stays_that_constant_across_seams_to_the_bit() {
    let (setup, atlas) = atlas(Seams::Joined, |_, _| 0.7);
    let made = levels(&setup, &atlas, &start(&[]), &[]);
    assert!(!atlas.margins().is_empty());
    let (light, soft) = (&made["tube_light"], &made["tube_soft"]);
    // What vertices hold is interpolated, so texels round it apart; the third channel is a constant of the rule's own.
    assert!(soft.iter().all(|texel| texel[2] == 1.0));
    assert!(light.iter().zip(soft).all(|(a, b)| (a[0] - b[0]).abs() < 2e-7));
}

#[test]
fn levels_across_seams_move_as_their_differences_do() {
    let (setup, atlas) = atlas(Seams::Joined, |along, up| 0.2 + 0.1 * along + 0.03 * up * up);
    for (k, (param, at)) in tube().params.iter().zip([0.4, 1.5]).enumerate() {
        let free: Vec<Param> = tube().params.clone();
        let made = levels(&setup, &atlas, &start(&[]), &free);
        let step = 1e-4;
        let [low, high] = [-step, step].map(|by| levels(&setup, &atlas, &start(&[(*param, at + by)]), &[]));
        let slope = &made[&format!("d{k}_tube_soft")];
        for texel in 0..atlas.covered() {
            // Where a tap crosses a texel's centre meanwhile, the two sides' slopes differ: few do, and not by much.
            let difference = (high["tube_soft"][texel][1] - low["tube_soft"][texel][1]) / (2.0 * step);
            assert!(
                (difference - slope[texel][1]).abs() < 2e-3,
                "{k} {texel}: {difference} {:?}",
                slope[texel]
            );
        }
    }
}
