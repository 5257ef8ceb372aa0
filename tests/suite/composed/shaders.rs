//! Every term, and what is found on the way, in a compute shader on an adapter, of the rules that fits there are made of.

use std::sync::Arc;

use skinfit::bake::reflected::ReflectedStack;
use skinfit::gpu::probe::{constants, evaluate};
use skinfit::gpu::upload::Content;
use skinfit::shader::Domain;
use skinfit::shader::emit::sample_fields;
use skinfit::shader::probe::Probe;
use skinfit::shader::search::components;
use skinfit_core::program::graph::Input;

use super::file::{Composed, OTHER, PLAIN, param};
use super::rules::Rules;
use super::stored::facts;
use super::terms::{LIGHT, ON_THE_WAY, TERMS};
use crate::fixtures::bare_scene;
use crate::graphics::bench::gpu;
use crate::vectors::reader::Vectors;

/// What a shader made of each fragment.
struct Shown {
    wanted: Vec<(&'static str, usize)>,
    numbers: Vec<Vec<f64>>,
}

impl Shown {
    fn of(&self, i: usize, name: &str) -> &[f64] {
        let mut at = 0;
        for (known, width) in &self.wanted {
            if *known == name {
                return &self.numbers[i][at..at + width];
            }
            at += width;
        }
        panic!("no {name}")
    }

    fn sum(&self, i: usize, names: &[&str]) -> [f64; 3] {
        [0, 1, 2].map(|c| names.iter().map(|name| self.of(i, name)[c]).sum())
    }
}

/// The quantities of those names of every fragment.
fn shown(own: &Composed<'_>, rules: &Rules, names: &[&'static str]) -> Option<Shown> {
    let gpu = gpu()?;
    let facts = facts(rules.setup);
    let given = sample_fields(&facts);
    let width = |name: &str| rules.widths.iter().find(|(known, _)| *known == name).unwrap().1;
    let wanted: Vec<(&'static str, usize)> = names.iter().map(|&name| (name, width(name))).collect();
    let kinds: Vec<_> =
        wanted.iter().map(|&(name, width)| (name, if width == 1 { "f32" } else { "vec3f" })).collect();
    let probe = Probe::new(&facts, Domain::Fragment, &given, &kinds).unwrap();
    let field =
        |i: usize, name: &str, component| own.field(i, &Input { name: name.to_owned(), component }) as f32;
    let items: Vec<f32> = (0..own.count())
        .flat_map(|i| {
            given.iter().flat_map(move |&(name, kind)| (0..components(kind)).map(move |c| field(i, name, c)))
        })
        .collect();
    let mut illumination = own.illumination();
    let one = own.cubes[0].map(|_| [1.0; 4]);
    let model = rules.setup.choices.specular_model;
    illumination.reflected = Some(ReflectedStack::new(model, &(0.2..=1.0), 1, |_| one.clone()));
    let content = Content {
        scene: Arc::new(bare_scene(rules.setup.effects)),
        illumination: Arc::new(illumination),
        occlusion: None,
        sky: None,
        thickness: None,
        params: own.params.clone(),
    };
    let got = evaluate(gpu, &probe, content, &constants(&probe, &own.params), &items).unwrap();
    let numbers = got.chunks(probe.width()).map(|item| item.iter().map(|&x| f64::from(x)).collect());
    Some(Shown { wanted, numbers: numbers.collect() })
}

/// What of the environment's lobe is looked at beside what the oracle has.
const LOBE: [&str; 4] = ["lobe_direction", "lobe_weight", "environment_share", "fresnel_environment"];

pub(super) fn compare(vectors: &Vectors) {
    let own = Composed::new(vectors);
    // WGSL asks of exp2, log2, division and square roots a few units in the last place, where a processor rounds correctly.
    let near = own.root.vector.tolerances().single.times(4.0);
    for (set, choices) in [("diffusion", PLAIN), ("choices", OTHER)] {
        let rules = Rules::new(&own, own.setup(choices, &["fresnel"]), &[]);
        let expected = own.root.at("expected").at(set);
        let (terms, looked_up) = (expected.at("terms"), expected.at("looked_up"));
        let parts = || TERMS.iter().filter(|(name, _)| terms.get(name).is_some());
        let found = || ON_THE_WAY.iter().filter(|(name, _)| looked_up.get(name).is_some());
        let mut names: Vec<&'static str> = parts().flat_map(|(_, parts)| parts.iter().copied()).collect();
        names.extend(found().map(|(_, quantity)| *quantity));
        names.extend(LIGHT.into_iter().chain(["haze", "lobe_roughness", "lobe_open"]).chain(LOBE));
        names.sort_unstable();
        names.dedup();
        let Some(shown) = shown(&own, &rules, &names) else { return };
        for i in 0..own.count() {
            for (name, parts) in parts() {
                near.check(name, &shown.sum(i, parts), &terms.at(name).item(i));
            }
            for (name, quantity) in found() {
                near.check(name, shown.of(i, quantity), &looked_up.at(name).item(i));
            }
            near.check("haze", shown.of(i, "haze"), &expected.at("haze").item(i));
            if choices == PLAIN {
                // The file's fragments without diffusion: all of it enters.
                let diffuse = own.root.at("expected").at("plain").at("terms").at("diffuse").item(i);
                near.check("diffuse", &shown.sum(i, &LIGHT), &diffuse);
            }
            let along = shown.of(i, "lobe_direction").try_into().unwrap();
            let light = own.lobe(along, shown.of(i, "lobe_roughness")[0]);
            near.check("E_r", &light, &looked_up.at("E_r").item(i));
            // E_r is 1 there.
            let share: f64 = ["lobe_weight", "lobe_open", "environment_share"]
                .iter()
                .map(|name| shown.of(i, name)[0])
                .product();
            let weight = own.params.rgb(param("specular_weight"));
            for (shown, weight) in shown.of(i, "fresnel_environment").iter().zip(weight) {
                let want = weight * share;
                assert!((shown - want).abs() <= near.abs + near.rel * want, "{shown} {want}");
            }
        }
    }
}
