//! Levels beside their definition, and how they move beside their differences.

use glam::{DVec2, DVec3};

use super::*;
use crate::model::diffusion::Taps;
use crate::program::lower::Natives;
use crate::program::shading::Shading;
use crate::shader::Facts;
use crate::shader::facts::FaceSizes;
use crate::shader::tangent::chain::Seed;

fn maker<R: Number>(setup: &Setup, free: &[Param]) -> LevelMaker<R> {
    let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
    let facts = Facts::of_samples(*setup, FaceSizes::default(), false);
    let shading = Shading::new(&facts, &seeds, |_| None, Natives::Called).unwrap();
    LevelMaker::new(shading.levels)
}

type Dense = Vec<Option<DVec3>>;

fn at(texels: &Dense, x: i64, y: i64) -> Option<DVec3> {
    let size = i64::from(SIZE);
    let inside = (0..size).contains(&x) && (0..size).contains(&y);
    if inside { texels[(y * size + x) as usize] } else { None }
}

/// One direction of a blur, by its definition.
fn blurred_by_hand(texels: &Dense, radius: f64, [across, down]: [i64; 2]) -> Dense {
    let texel = |i: usize| {
        let (x, y) = ((i % SIZE as usize) as i64, (i / SIZE as usize) as i64);
        at(texels, x, y)?;
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for tap in -3..=3 {
            let (place, weight) = (radius * f64::from(tap), (-0.5 * f64::from(tap * tap)).exp());
            let low = place.floor();
            for (side, share) in [(0, 1.0 - (place - low)), (1, place - low)] {
                let step = low as i64 + side;
                if let Some(value) = at(texels, x + step * across, y + step * down) {
                    sum += weight * share * value;
                    weights += weight * share;
                }
            }
        }
        Some(sum / weights)
    };
    (0..texels.len()).map(texel).collect()
}

#[test]
fn levels_are_what_their_definition_says() {
    let setup = setup(&[hills()]);
    let (atlas, maker) = (atlas(&setup), maker::<f64>(&setup, &[]));
    let radius = 1.7;
    let params = start(&[(hills().params[1], radius)]).params;
    let levels = maker.make(&atlas, &params, &CubesAt::dark(f64::from)).all();
    let light: Dense = (0..SIZE * SIZE)
        .map(|i| {
            let uv = (DVec2::new(f64::from(i % SIZE), f64::from(i / SIZE)) + 0.5) / f64::from(SIZE);
            let inside = uv.min_element() > f64::from(LOW) && uv.max_element() < f64::from(HIGH);
            let within = (5.0 * uv).fract();
            inside.then(|| (4.0 * within * (1.0 - within)).extend(uv.x * uv.y))
        })
        .collect();
    let soft = blurred_by_hand(&blurred_by_hand(&light, radius, [1, 0]), radius, [0, 1]);
    let covered = light.iter().flatten().count();
    assert!(atlas.covered() == covered && covered > 1000 && covered < light.len());
    for (place, got) in levels["hills_soft"].iter().enumerate() {
        let [x, y] = atlas.texel(place).map(i64::from);
        let off = (DVec3::from(*got) - at(&soft, x, y).unwrap()).abs().max_element();
        // Texels hold texture coordinates in f32, 6e-8 of 1, on which the hills rise by 20 at most.
        assert!(off < 3e-6, "texel ({x}, {y}): {off}");
    }
    // In f32: some tens of roundings beside.
    let single = self::maker::<f32>(&setup, &[]).make(&atlas, &params, &CubesAt::dark(|x| x)).all();
    for (a, b) in single["hills_soft"].iter().flatten().zip(levels["hills_soft"].iter().flatten()) {
        assert!((f64::from(*a) - b).abs() < 3e-6, "{a} {b}");
    }
}

#[test]
fn levels_move_as_their_differences_do() {
    let setup = setup(&[furrows()]);
    let free = &furrows().params[..2];
    let (atlas, maker) = (atlas(&setup), maker::<f64>(&setup, free));
    let (base, step) = (Params::defaults(Form::Corrected), 1e-6);
    let make = |params: &Params| maker.make(&atlas, params, &CubesAt::dark(f64::from)).all();
    let levels = make(&base);
    // The square's side over the texels that it covers.
    let side = 2.0 / (f64::from(SIZE) * f64::from(HIGH - LOW));
    for [u, v, _] in &levels["furrows_stretch"] {
        // Its steps are stored in f32.
        assert!((u - side).abs() < 1e-6 * side && (v - side).abs() < 1e-6 * side, "{u} {v} {side}");
    }
    for (k, &param) in free.iter().enumerate() {
        let moved = |by: f64| {
            let mut params = base.clone();
            params.set(param, base.scalar(param) + by);
            make(&params)
        };
        let (more, less) = (moved(step), moved(-step));
        for name in ["furrows_soft", "furrows_again"] {
            let tangents = levels[&format!("d{k}_{name}")].iter().flatten();
            let mut largest = 0.0_f64;
            for ((tangent, more), less) in
                tangents.zip(more[name].iter().flatten()).zip(less[name].iter().flatten())
            {
                let difference = (more - less) / (2.0 * step);
                largest = largest.max(tangent.abs());
                // Values near 1 round to 1e-16, over a step of 2e-6; no tap crosses a texel within it.
                assert!(
                    (tangent - difference).abs() < 1e-7,
                    "{name} by {}: {tangent} {difference}",
                    param.name()
                );
            }
            assert!(largest > 0.05, "{name}: {largest}");
        }
    }
}

#[test]
fn the_levels_of_an_earlier_frame_go() {
    let setup = setup(&[hills()]);
    let maker = maker::<f64>(&setup, &[]);
    let params = start(&[(hills().params[1], 1.7)]).params;
    let made = |atlas: &Arc<Atlas>| maker.levels(atlas, &params, || CubesAt::dark(f64::from));
    for frame in 1..4 {
        let atlas = atlas(&setup);
        assert!(Arc::ptr_eq(&made(&atlas), &made(&atlas)));
        assert_eq!((maker.count(), maker.last.lock().unwrap().len()), (frame, 1));
    }
}

/// A light map that eleven parameters move, each in its own way, and a Gaussian of it.
fn ridges() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| {
        let (mut declared, mut heads, mut sum) = (String::new(), String::new(), String::new());
        for k in 0..RIDGES {
            declared += &format!("// parameter: ridges_{k} = 0.{k}5 in [0, 2]; how high; a test\n");
            heads += &format!(", ridges_{k}: f32");
            sum += &format!(" + ridges_{k} * vec3f(fract({k}.5 * u), fract({k}.7 * v), fract(u * {k}.0 + v))");
        }
        let text = format!(
            "// effect: ridges, light of many heights\n{declared}\
             // parameter: ridges_radius = 1.7 in [0, 30], unit texels; how far it wandered; a test\n//\n\
             // gives: ridges_light\n// domain: texel\n// cost: 9\n\
             fn ridges_map(vertex_uv: vec2f{heads}) -> vec3f {{\n    let u: f32 = 5.0 * vertex_uv.x;\n    \
             let v: f32 = 5.0 * vertex_uv.y;\n    return vec3f(0.1){sum};\n}}\n\n\
             // gives: ridges_soft\n// domain: texel\n// pass: ridges_light: vec3f, gaussian\n// sampled: 0\n// cost: 8\n\
             fn ridges_kernel(axis: vec2f, ridges_radius: f32) -> f32 {{\n    return ridges_radius;\n}}\n\n\
             // gives: ridges_part\n// adds: ridges\n// cost: 1\n\
             fn ridges_shown(ridges_soft: vec3f) -> vec3f {{\n    return ridges_soft;\n}}\n"
        );
        register("ridges", &text).unwrap_or_else(|error| panic!("{error}"))
    })
}

/// How many of them: several registers of sixteen numbers, three a leaf.
const RIDGES: usize = 11;

#[test]
fn a_level_moves_along_each_of_many_parameters_as_along_that_one_alone() {
    let term = ridges();
    let (radius, heights) = (term.params[RIDGES], &term.params[..RIDGES]);
    for taps in [Taps::Five, Taps::Seven, Taps::Nine, Taps::Full] {
        let mut setup = setup(&[term]);
        setup.choices.diffusion.taps = taps;
        let atlas = atlas(&setup);
        let moved = |free: &[Param], by: f64| {
            let params = start(&[(radius, by)]).params;
            maker::<f32>(&setup, free).make(&atlas, &params, &CubesAt::dark(|x| x)).all()
        };
        // As wide as a head at the most, where every tap of most texels is off the chart.
        for by in [0.0, 1.7, 29.0] {
            // The radius moves the level by itself, the heights move what is blurred.
            let alone: Vec<_> = heights.iter().map(|&height| moved(&[height], by)).collect();
            let of_radius = moved(&[radius], by);
            for count in [1, 4, 5, 6, 7, RIDGES] {
                let free: Vec<Param> = heights[..count].iter().copied().chain([radius]).collect();
                let levels = moved(&free, by);
                assert_eq!(levels["ridges_soft"], of_radius["ridges_soft"], "{taps:?} {by} {count}");
                assert_eq!(
                    levels[&format!("d{count}_ridges_soft")],
                    of_radius["d0_ridges_soft"],
                    "{taps:?} {by} {count}"
                );
                for (k, alone) in alone.iter().enumerate().take(count) {
                    assert_eq!(
                        levels[&format!("d{k}_ridges_soft")],
                        alone["d0_ridges_soft"],
                        "{taps:?} {by} {k} of {count}"
                    );
                }
            }
        }
    }
}
