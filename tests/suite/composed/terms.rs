//! Terms, their sum, its Jacobian and what is found on the way, in every kind of number.

use skinfit::engine::lanes::Lanes;
use skinfit::model::choices::Choices;
use skinfit::model::diffusion::{DiffusionChoices, Taps};
use skinfit::model::params::Param;

use super::file::{Composed, OTHER, PLAIN, param};
use super::lacking::{self, ByHand, Lacking, in_lobe};
use super::rules::{Rules, Shaded};
use crate::by_rules::Number;
use crate::vectors::reader::{Node, Tolerance, Vectors};

/// The terms of the rules that each of the oracle's is.
pub(super) const TERMS: [(&str, &[&str]); 6] = [
    ("side_specular", &["side_part"]),
    ("hilite", &["hilite_part"]),
    ("reflection", &["mirror_part"]),
    ("key_light", &["key_part"]),
    ("light_specular", &LAMPS_MIRRORED),
    ("transmission", &["transmission_part"]),
];
const LAMPS_MIRRORED: [&str; 3] =
    ["light_sun_specular_part", "light_lamp_specular_part", "light_spot_specular_part"];
pub(super) const LIGHT: [&str; 4] = ["diffuse_part", "light_sun_part", "light_lamp_part", "light_spot_part"];

/// What the oracle found on the way, and the rules' quantities.
pub(super) const ON_THE_WAY: [(&str, &str); 8] = [
    ("n", "n"),
    ("R", "reflected"),
    ("rim", "rim"),
    ("occ", "occ"),
    ("m", "lobe_roughness"),
    ("NV", "view_cosine"),
    ("f0", "lobe_f0"),
    ("SO", "lobe_open"),
];

/// One of the file's sums: its name there, the effects beside the others, the choices, and what is diffuse light.
pub(super) struct Set {
    pub(super) name: &'static str,
    pub(super) added: &'static [&'static str],
    pub(super) choices: Choices,
    diffuse: &'static [&'static str],
}

pub(super) const PLAIN_SET: Set = Set { name: "plain", added: &[], choices: PLAIN, diffuse: &LIGHT };
pub(super) const DIFFUSION: Set =
    Set { name: "diffusion", added: &["diffusion"], choices: PLAIN, diffuse: &["diffuse_part"] };
const FULL: Set = Set {
    name: "diffusion_full",
    choices: Choices {
        diffusion: DiffusionChoices { taps: Taps::Full, ..DiffusionChoices::DEFAULT },
        ..PLAIN
    },
    ..DIFFUSION
};

/// Texels and texture coordinates are stored in f32, from which levels and lookups are made: some roundings more.
const STORED: Tolerance = Tolerance { abs: 2e-6, rel: 2e-6 };

impl Set {
    /// The tolerance for numbers of a kind: the file's, but where f64 begins with what is stored.
    fn near<R: Number>(&self, root: &Node<'_>) -> Tolerance {
        tolerance::<R>(root, !self.added.is_empty())
    }
}

fn tolerance<R: Number>(root: &Node<'_>, stored: bool) -> Tolerance {
    let tolerances = root.vector.tolerances();
    match (size_of::<R>() == size_of::<f64>(), stored) {
        (true, false) => tolerances.double,
        (true, true) => STORED,
        (false, _) => tolerances.single,
    }
}

/// What differences leave: the square of a step of 1e-4, and roundings of 1e-16 over it; and of levels ten times what they are
/// off by themselves, as a blur's slope is that of its weights.
pub(super) fn of_slopes(near: Tolerance, levels: bool) -> Tolerance {
    let near = near.times(if levels { 10.0 } else { 1.0 });
    Tolerance { abs: near.abs.max(1e-7), rel: near.rel.max(1e-7) }
}

/// Every sum in one kind of number, beside what the rules lack.
struct Compared<'c, 'v> {
    own: &'c Composed<'v>,
    lobe: Lacking,
    choices: Lacking,
}

impl Compared<'_, '_> {
    fn sum<R: Number>(&self, set: &Set, like: R) {
        let (own, columns) = (self.own, self.own.columns());
        let (near, expected) = (set.near::<R>(&own.root), own.root.at("expected").at(set.name));
        let rules = Rules::new(own, own.setup(set.choices, set.added), &columns);
        let found = rules.look_up::<R>(own, &own.params);
        for i in 0..own.count() {
            let shaded = rules.shade(own, &own.params, [0.0; 3], (i, &found), like);
            let terms = expected.at("terms");
            for (name, parts) in TERMS {
                if let Some(term) = terms.get(name) {
                    near.check(name, &shaded.sum(parts), &term.item(i));
                }
            }
            near.check("diffuse", &shaded.sum(set.diffuse), &terms.at("diffuse").item(i));
            near.check("haze", &shaded.rgba[0][3..], &expected.at("haze").item(i));
            if let Some(scattered) = expected.get("looked_up").and_then(|found| found.get("scattered")) {
                near.check("scattered", shaded.of("scattered_light"), &scattered.item(i));
            }
            if let Some(term) = terms.get("fresnel") {
                tolerance::<f64>(&own.root, false).check("fresnel", &self.lobe.value[i], &term.item(i));
            }
            whole(&expected, &columns, &shaded, (&self.lobe, i), (near, !set.added.is_empty()));
        }
    }

    /// The other named choices, whose split sum the rules have no table of.
    fn choices<R: Number>(&self, like: R) {
        let (own, columns) = (self.own, with_choices(self.own.columns()));
        let expected = own.root.at("expected").at("choices");
        let rules = Rules::new(own, own.setup(OTHER, &["diffusion"]), &columns);
        let found = rules.look_up::<R>(own, &own.params);
        let near = tolerance::<R>(&own.root, true);
        for i in 0..own.count() {
            let at = rules.shade(own, &own.params, [0.0; 3], (i, &found), like);
            let terms = expected.at("terms");
            near.check("light_specular", &at.sum(&LAMPS_MIRRORED), &terms.at("light_specular").item(i));
            near.check("haze", &at.rgba[0][3..], &expected.at("haze").item(i));
            whole(&expected, &columns, &at, (&self.choices, i), (near, true));
        }
    }
}

/// The sum and its Jacobian.
fn whole(
    expected: &Node<'_>,
    columns: &[Param],
    shaded: &Shaded,
    (lacking, i): (&Lacking, usize),
    (near, levels): (Tolerance, bool),
) {
    let result = [0, 1, 2].map(|c| shaded.rgba[0][c] + lacking.value[i][c]);
    near.check("result", &result, &expected.at("result").item(i));
    let (near, want) = (of_slopes(near, levels), expected.at("J").item(i));
    for (k, column) in columns.iter().enumerate() {
        for c in 0..4 {
            let rest = if c < 3 { lacking.slopes[k][i][c] } else { 0.0 };
            near.check(column.name(), &[shaded.rgba[1 + k][c] + rest], &want.item(c).item(k));
        }
    }
}

/// The columns of the file's other choices.
fn with_choices(mut columns: Vec<Param>) -> Vec<Param> {
    columns.extend(["fresnel_loss", "f0_floor"].map(param));
    columns
}

/// The quantities on the way.
fn on_the_way<R: Number>(own: &Composed<'_>, like: R) {
    let expected = own.root.at("expected");
    let [near, double] = [tolerance::<R>(&own.root, false), tolerance::<f64>(&own.root, false)];
    let [plain, other] = [PLAIN, OTHER].map(|choices| Rules::new(own, own.setup(choices, &["fresnel"]), &[]));
    for (rules, set, names) in [
        (&plain, "diffusion", &ON_THE_WAY[..]),
        (&other, "choices", &[("f0", "lobe_f0"), ("SO", "lobe_open")]),
    ] {
        let found = rules.look_up::<R>(own, &own.params);
        let looked_up = expected.at(set).at("looked_up");
        for i in 0..own.count() {
            let at = rules.shade(own, &own.params, [1.0; 3], (i, &found), like);
            let exact = rules.shade(own, &own.params, [1.0; 3], (i, &found), 0.0_f64);
            for (name, quantity) in names {
                near.check(name, at.of(quantity), &looked_up.at(name).item(i));
            }
            let one = |name: &str| exact.of(name)[0];
            if let (Some(a), Some(b)) = (looked_up.get("a"), looked_up.get("b")) {
                let found = own.split_sum(one("view_cosine"), one("lobe_roughness"));
                double.check("a", &found[..1], &a.item(i));
                double.check("b", &found[1..], &b.item(i));
            }
            let light = own.lobe(exact.three("lobe_direction"), one("lobe_roughness"));
            double.check("E_r", &light, &looked_up.at("E_r").item(i));
            assert_shown(own, &at, near);
            let fresnel = expected.at(set).at("terms").at("fresnel");
            double.check("fresnel", &in_lobe(own, &exact, &own.params), &fresnel.item(i));
        }
    }
}

/// Where E_r is 1 the environment's lobe shows specular_weight s SO es.
fn assert_shown(own: &Composed<'_>, at: &Shaded, near: Tolerance) {
    let one = |name: &str| at.of(name)[0];
    for (shown, weight) in at.of("fresnel_environment").iter().zip(own.params.rgb(param("specular_weight"))) {
        let want = weight * one("lobe_weight") * one("lobe_open") * one("environment_share");
        assert!((shown - want).abs() <= near.abs + near.rel * want, "{shown} {want}");
    }
}

/// The terms of the other choices that the oracle's split sum is in.
fn by_hand(own: &mut Composed<'_>) {
    let constants = own.root.at("constants").at("other_choices");
    own.params.set(param("fresnel_loss"), constants.at("fresnel_loss").number());
    let near = tolerance::<f64>(&own.root, true);
    let terms = own.root.at("expected").at("choices").at("terms");
    for (i, found) in lacking::Choices::new(own).each(own, &own.params).into_iter().enumerate() {
        let ByHand { diffuse, fresnel, skin_reflection, .. } = found;
        near.check("diffuse", &diffuse, &terms.at("diffuse").item(i));
        near.check("fresnel", &fresnel, &terms.at("fresnel").item(i));
        near.check("skin in the lobe", &skin_reflection, &terms.at("skin_reflection").item(i));
    }
}

/// All of the file.
pub(super) fn compare(vectors: &Vectors) {
    let own = Composed::new(vectors);
    let mut with_loss = Composed::new(vectors);
    by_hand(&mut with_loss);
    let columns = own.columns();
    let lobe = Lacking::lobe(&own, &columns);
    let choices = Lacking::choices(&with_loss, &with_choices(columns));
    let compared = Compared { own: &own, lobe, choices };
    fn every<R: Number>(compared: &Compared<'_, '_>, like: R) {
        [PLAIN_SET, DIFFUSION, FULL].iter().for_each(|set| compared.sum(set, like));
        compared.choices(like);
    }
    every(&compared, 0.0_f64);
    every(&compared, 0.0_f32);
    on_the_way(&own, 0.0_f64);
    on_the_way(&own, 0.0_f32);
    for level in skinfit::simd::levels() {
        skinfit_core::with_simd!(level, simd => every(&compared, Lanes::splat(simd, 0.0)));
    }
}
