//! The rules: what each gives, from what, where, at what cost and with what error.
//!
//! A rule is a WGSL file under `rules/`, in the folder of its stage: comments that say what it is for,
//! header lines, and one function.
//!
//! ```wgsl
//! // R = V - 2 n (n.V) (MODEL 3, corrected form).
//! //
//! // gives: reflected
//! // when: corrected
//! // cost: 7
//! fn mirror_direction(n: vec3f, view: vec3f) -> vec3f {
//!     return view - 2.0 * dot(n, view) * n;
//! }
//! ```
//!
//! Its parameters are the quantities that it needs. A quantity of the vertex stage that a fragment rule
//! names is interpolated. Other header lines: `reads` (resources and constants that the body names),
//! `uses` (files of `rules/lib`), `error` (relative to white; a number or `tessellation`), `paper: yes`
//! (the paper's own programs made this approximation).

use std::sync::LazyLock;

use super::facts::{Budget, Facts};

/// Where a rule is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Once a vertex.
    Vertex,
    /// Once a fragment or stored sample.
    Fragment,
}

/// One rule.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The file's name without its ending.
    pub name: &'static str,
    /// Where it is evaluated.
    pub stage: Stage,
    /// What it is, in words.
    pub about: String,
    /// Quantities that it gives, each with the components of the function's value that hold it.
    pub gives: Vec<(&'static str, &'static str)>,
    /// Conditions on the [`Facts`], all of which must hold.
    pub when: Vec<&'static str>,
    /// Operations, about; and how many more for each morph target.
    cost: f64,
    cost_a_morph: f64,
    error: Error,
    /// Whether the paper's own programs made this approximation.
    pub paper: bool,
    /// Library files that it calls.
    pub uses: Vec<&'static str>,
    /// Resources and constants that the body names.
    pub reads: Vec<&'static str>,
    /// The function's name.
    pub function: &'static str,
    /// The function's parameters: quantity and WGSL type.
    pub needs: Vec<(&'static str, &'static str)>,
    /// The WGSL type of the function's value.
    pub returns: &'static str,
    /// The function.
    pub body: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    Fixed(f64),
    Tessellation,
}

impl Rule {
    /// Operations in a scene.
    #[must_use]
    pub fn cost(&self, facts: &Facts) -> f64 {
        self.cost + self.cost_a_morph * f64::from(facts.morphs)
    }

    /// How far it is off in a scene, relative to white.
    #[must_use]
    pub fn error(&self, facts: &Facts) -> f64 {
        match self.error {
            Error::Fixed(error) => error,
            Error::Tessellation => facts.tessellation,
        }
    }

    /// The value of a rule that hands on its only parameter (an empty text), or gives a fixed number: no
    /// function needs to be written for it.
    #[must_use]
    pub fn plain_value(&self) -> Option<&'static str> {
        let value = self.body.trim_end().strip_suffix(";\n}")?.split_once("{\n    return ")?.1;
        match self.needs.as_slice() {
            [] => Some(value),
            [(only, _)] if *only == value => Some(""),
            _ => None,
        }
    }

    /// Why it cannot be used in a scene; `None` when it can.
    #[must_use]
    pub fn refusal(&self, facts: &Facts) -> Option<String> {
        if let Some(condition) = self.when.iter().find(|c| facts.holds(c) != Some(true)) {
            let (only, fact) = condition.strip_prefix('!').map_or(("only", *condition), |fact| ("not", fact));
            return Some(format!(
                "{only} with {}",
                fact.strip_prefix("has_").unwrap_or(fact).replace('_', " ")
            ));
        }
        if self.error == Error::Fixed(0.0) {
            return None;
        }
        let error = self.error(facts);
        match facts.budget {
            Budget::Exact => Some(format!("error {error:.1e}, where none is allowed")),
            Budget::Paper if self.paper => None,
            Budget::Paper => Some("not what the paper did".to_owned()),
            Budget::Within(most) if error <= most => None,
            Budget::Within(most) => Some(format!("error {error:.1e}, above {most:.1e}")),
        }
    }

    fn parse(stage: Stage, name: &'static str, text: &'static str) -> Result<Self, String> {
        let start = text.find("fn ").filter(|&at| at == 0 || text.as_bytes()[at - 1] == b'\n');
        let (header, body) = text.split_at(start.ok_or("no function")?);
        let mut rule = Self {
            name,
            stage,
            about: String::new(),
            gives: Vec::new(),
            when: Vec::new(),
            cost: f64::NAN,
            cost_a_morph: 0.0,
            error: Error::Fixed(0.0),
            paper: false,
            uses: Vec::new(),
            reads: Vec::new(),
            function: "",
            needs: Vec::new(),
            returns: "",
            body,
        };
        for line in header.lines() {
            rule.header_line(line.trim_start_matches('/').trim())?;
        }
        rule.signature()?;
        if rule.gives.is_empty() || !rule.cost.is_finite() {
            return Err("it needs `gives` and `cost`".to_owned());
        }
        Ok(rule)
    }

    fn header_line(&mut self, line: &'static str) -> Result<(), String> {
        let list = |value: &'static str| value.split(',').map(str::trim).filter(|v| !v.is_empty());
        let number = |text: &str| text.trim().parse::<f64>().map_err(|e| format!("{text}: {e}"));
        match line.split_once(": ") {
            Some(("gives", value)) => {
                self.gives = list(value).map(|q| q.split_once('.').unwrap_or((q, ""))).collect();
            }
            Some(("when", value)) => self.when = list(value).collect(),
            Some(("uses", value)) => self.uses = list(value).collect(),
            Some(("reads", value)) => self.reads = list(value).collect(),
            Some(("paper", value)) => self.paper = value == "yes",
            Some(("error", "tessellation")) => self.error = Error::Tessellation,
            Some(("error", value)) => self.error = Error::Fixed(number(value)?),
            Some(("cost", value)) => match value.strip_suffix(" a morph") {
                Some(costs) => {
                    let (fixed, each) = costs.split_once(" and ").unwrap_or(("0", costs));
                    (self.cost, self.cost_a_morph) = (number(fixed)?, number(each)?);
                }
                None => self.cost = number(value)?,
            },
            _ if line.is_empty() => {}
            _ => {
                if !self.about.is_empty() {
                    self.about.push(' ');
                }
                self.about.push_str(line);
            }
        }
        Ok(())
    }

    /// Name, parameters and value of the function.
    fn signature(&mut self) -> Result<(), String> {
        let open = self.body.find('(').ok_or("no parameter list")?;
        let close = self.body.find(") -> ").ok_or("no value")?;
        let end = self.body.find(" {").ok_or("no body")?;
        self.function = self.body["fn ".len()..open].trim();
        self.returns = self.body[close + ") -> ".len()..end].trim();
        let parameters = self.body[open + 1..close].split(',').map(str::trim).filter(|p| !p.is_empty());
        self.needs = parameters
            .map(|p| p.split_once(": ").ok_or_else(|| format!("parameter {p}")))
            .collect::<Result<_, _>>()?;
        Ok(())
    }
}

macro_rules! rules {
    ($stage:ident in $folder:literal: $($name:ident)*) => {
        [$((Stage::$stage, stringify!($name), include_str!(concat!("rules/", $folder, "/", stringify!($name), ".wgsl")))),*]
    };
}

#[rustfmt::skip]
const VERTEX: [(Stage, &str, &str); 19] = rules! { Vertex in "vertex":
    unmorphed_position morph_position unskinned_position skin_position clip
    unmorphed_normal morph_normal unskinned_normal skin_normal
    morphed_tangent unskinned_tangent skin_tangent vertex_tangent vertex_bitangent
    unmorphed_occlusion morph_occlusion vertex_uv vertex_view vertex_silhouette
};

#[rustfmt::skip]
const FRAGMENT: [(Stage, &str, &str); 80] = rules! { Fragment in "fragment":
    view_exact view_interpolated smooth_normal smooth_normal_unguarded normal_of_base
    color_texels color_map color_neutral specular_texels specular_map specular_neutral
    attenuator_texels attenuator_map attenuator_neutral normal_texels normal_map normal_neutral
    color_specular_texels color_specular_map normal_attenuator_texels normal_attenuator_map
    decoded decoded_as_listed base_bumped bump n_bumped n_bumped_as_listed n_smooth n_smooth_as_listed
    n_of_base n_of_base_as_listed reflected reflected_as_listed dapple dapple_as_listed
    silhouette_interpolated silhouette_approximated silhouette_smooth silhouette_bumped
    rim rim_squared open occ occ_open
    n_turned n_unturned n_place n_place_as_listed
    reflected_turned reflected_unturned reflected_place reflected_place_as_listed
    view_turned view_unturned view_place view_place_as_listed
    irradiance_faces irradiance_cube side_light_faces side_light_cube
    mirror_light_faces mirror_light_cube hilite_light_faces hilite_light_cube
    diffuse_term side_term hilite_term mirror_term haze_term key_term
    base_part rim_part diffuse_part diffuse_part_f16 diffuse_part_without_rim
    side_part hilite_part mirror_part key_part haze
};

/// Functions that several rules call, in the order of their dependence.
pub const LIBRARY: [(&str, &str); 4] = [
    ("vector", include_str!("rules/lib/vector.wgsl")),
    ("frame", include_str!("rules/lib/frame.wgsl")),
    ("cube", include_str!("rules/lib/cube.wgsl")),
    ("texels", include_str!("rules/lib/texels.wgsl")),
];

/// Every rule.
pub static RULES: LazyLock<Vec<Rule>> = LazyLock::new(|| {
    let read = |&(stage, name, text): &(Stage, &'static str, &'static str)| {
        Rule::parse(stage, name, text).unwrap_or_else(|error| panic!("rules/{name}.wgsl: {error}"))
    };
    VERTEX.iter().chain(&FRAGMENT).map(read).collect()
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::quantity::{Attribute, Constant, Resource};

    #[test]
    fn every_file_is_a_rule() {
        for (folder, stage) in [("vertex", Stage::Vertex), ("fragment", Stage::Fragment)] {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shader/rules").join(folder);
            for entry in std::fs::read_dir(path).unwrap() {
                let name = entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned();
                assert!(RULES.iter().any(|rule| rule.name == name && rule.stage == stage), "{name}");
            }
        }
    }

    #[test]
    fn whatever_a_rule_names_exists() {
        let facts = Facts::default();
        for rule in RULES.iter() {
            for condition in &rule.when {
                assert!(facts.holds(condition).is_some(), "{}: when {condition}", rule.name);
            }
            for library in &rule.uses {
                assert!(LIBRARY.iter().any(|(name, _)| name == library), "{}: uses {library}", rule.name);
            }
            for read in &rule.reads {
                let resource = Resource::ALL.iter().any(|r| r.name() == *read);
                assert!(resource || Constant::from_name(read).is_some(), "{}: reads {read}", rule.name);
                assert!(rule.body.contains(read), "{} does not read {read}", rule.name);
            }
            for (quantity, _) in &rule.needs {
                let given = RULES.iter().any(|r| r.gives.iter().any(|(q, _)| q == quantity));
                let leaf = Constant::from_name(quantity).is_some()
                    || Attribute::ALL.iter().any(|a| a.name() == *quantity)
                    || *quantity == "vertex_index";
                assert!(given || leaf, "{}: nothing gives {quantity}", rule.name);
            }
        }
    }

    #[test]
    fn a_quantity_has_one_type() {
        let mut types = std::collections::BTreeMap::new();
        for (quantity, kind) in RULES.iter().flat_map(|rule| rule.needs.iter().copied()) {
            assert_eq!(*types.entry(quantity).or_insert(kind), kind, "{quantity}");
        }
        for rule in RULES.iter() {
            for (quantity, components) in &rule.gives {
                let given = match (components.len(), rule.returns) {
                    (0, whole) => whole,
                    (1, _) => "f32",
                    (2, _) => "vec2f",
                    _ => "vec3f",
                };
                assert_eq!(*types.get(quantity).unwrap_or(&given), given, "{}: {quantity}", rule.name);
            }
        }
    }
}
