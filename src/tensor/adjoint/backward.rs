//! The backward module: seeds, and what becomes of their tangents.

use std::fmt::Write as _;

use super::text::{HEAD, Text};
use super::{Adjoint, AdjointError, Binding, Input, Lookup, Module, WORKGROUP};
use crate::model::params::{Channels, Param};
use crate::shader::Domain;
use crate::shader::atlas::stored;
use crate::shader::emit::with_haze;
use crate::shader::module::uniform;
use crate::shader::tangent::chain::{Chain, Seed};

/// A column's parameter as a seed: cubes that it acts through, too, are inputs of their own.
pub(crate) fn of_column(param: Param) -> Seed {
    Seed { resources: Vec::new(), ..Seed::of_param(param) }
}

/// What becomes of a seed's tangent.
#[derive(Clone, Copy, Debug)]
enum Gain {
    /// It is added to a column's sum.
    Column(usize),
    /// It is a sample's: of one component, or channel by channel.
    Field(Input, Option<usize>),
    /// It is that of the light of a lookup, at that place.
    Light(usize, &'static str),
}

impl Adjoint {
    /// The module that yields the adjoints of `wanted`, which the model reads.
    ///
    /// # Errors
    /// When a rule has no derivative, or a wanted cube none.
    pub fn backward(&self, wanted: &[Input]) -> Result<Module, AdjointError> {
        let mut text = Text::new(self);
        text.bind(Binding::ImageAdjoint);
        let mut moved = Vec::new();
        for &input in wanted {
            moved.extend(self.seeds(input)?);
        }
        let (seeds, gains): (Vec<Seed>, Vec<Vec<Gain>>) = moved.into_iter().unzip();
        let chain = Chain::new(&self.plan, &seeds)?;
        for gain in gains.iter().flatten() {
            match *gain {
                Gain::Column(_) => text.bind(Binding::PartialSums),
                Gain::Field(input, _) => text.bind(Binding::Gradient(input)),
                Gain::Light(index, _) => {
                    text.bind(Binding::LightAdjoint(index));
                    text.bind(Binding::LightPlace(index));
                }
            }
        }
        let sums = if wanted.contains(&Input::Columns) { self.columns.len() } else { 0 };
        let mut wgsl = text.declarations(&chain.functions);
        if sums > 0 {
            let _ = write!(wgsl, "\nvar<workgroup> tree: array<f32, {WORKGROUP}>;\n");
        }
        wgsl.push_str(HEAD);
        (0..sums).for_each(|k| {
            let _ = writeln!(wgsl, "    var sum{k} = 0.0;");
        });
        wgsl.push_str("    if (slot < part.slots) {\n    let pixel = vec4f(image_adjoint[4u * slot], image_adjoint[4u * slot + 1u], image_adjoint[4u * slot + 2u], image_adjoint[4u * slot + 3u]);\n");
        wgsl.push_str(&text.record());
        wgsl.push_str("        let adjoint = share * pixel;\n");
        wgsl.push_str(&stored(&self.plan.levels));
        wgsl.push_str(&self.plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
        wgsl.push_str(&chain.shared);
        chain.lines.iter().for_each(|lines| wgsl.push_str(lines));
        for (k, gains) in gains.iter().enumerate() {
            for gain in gains {
                self.gain(&mut wgsl, *gain, chain.radiance[k].as_deref(), chain.haze[k].as_deref());
            }
        }
        wgsl.push_str("    }\n    }\n");
        (0..sums).for_each(|k| {
            let _ = write!(
                wgsl,
                "    tree[thread] = sum{k};\n    for (var half = {WORKGROUP}u / 2u; half > 0u; half /= 2u) {{\n        workgroupBarrier();\n        if (thread < half) {{\n            tree[thread] += tree[thread + half];\n        }}\n    }}\n    if (thread == 0u) {{\n        partial_sums[(workgroup.x + workgroup.y * workgroups.x) * {sums}u + {k}u] = tree[0];\n    }}\n    workgroupBarrier();\n"
            );
        });
        wgsl.push_str("}\n");
        Ok(Module { wgsl, bindings: text.bindings })
    }

    /// What moves for an input's sake, and what becomes of each tangent.
    fn seeds(&self, input: Input) -> Result<Vec<(Seed, Vec<Gain>)>, AdjointError> {
        let named = Seed::named;
        Ok(match input {
            Input::Columns => {
                let columns = || self.columns.iter().enumerate();
                let first =
                    |k: usize| columns().position(|(_, c)| c.param == self.columns[k].param) == Some(k);
                let of = |param: Param| {
                    columns().filter(move |(_, c)| c.param == param).map(|(k, _)| Gain::Column(k)).collect()
                };
                let params = columns().filter(|(k, _)| first(*k)).map(|(_, column)| column.param);
                params.map(|param| (of_column(param), of(param))).collect()
            }
            // What stands in a level may be no colour: number by number.
            Input::Levels => {
                let of = |(k, (level, component)): (usize, (usize, usize))| {
                    let level = &self.plan.levels[level];
                    let needed = self.plan.steps.iter().flat_map(|step| &step.rule.needs);
                    let name = needed.map(|(need, _)| *need).find(|need| *need == level.name)?;
                    Some((named(name, &level.unit(component)), vec![Gain::Field(input, Some(k))]))
                };
                self.looked_up().enumerate().filter_map(of).collect()
            }
            // Channels never mix: all three move at once.
            Input::Albedo => vec![(named("albedo", "vec3f(1.0)"), vec![Gain::Field(input, None)])],
            Input::Bump => ["vec3f(1.0, 0.0, 0.0)", "vec3f(0.0, 1.0, 0.0)", "vec3f(0.0, 0.0, 1.0)"]
                .into_iter()
                .enumerate()
                .map(|(k, unit)| (named("bump", unit), vec![Gain::Field(input, Some(k))]))
                .collect(),
            Input::Specular | Input::Attenuator | Input::Open => {
                vec![(named(input.name(), "1.0"), vec![Gain::Field(input, Some(0))])]
            }
            Input::Irradiance | Input::Lobe | Input::Hilite | Input::Reflected | Input::Glossy => {
                let of = |(i, lookup): (usize, Lookup)| {
                    let (light, kind) = lookup.light;
                    Ok((named(light, &format!("{kind}(1.0)")), vec![Gain::Light(i, lookup.placed()?)]))
                };
                self.lookups(input).map(of).collect::<Result<_, AdjointError>>()?
            }
        })
    }

    /// The line that takes a tangent to where it is wanted.
    fn gain(&self, wgsl: &mut String, gain: Gain, radiance: Option<&str>, haze: Option<&str>) {
        let moved = with_haze(radiance, haze);
        let _ = match gain {
            Gain::Column(k) => match self.columns[k].channels {
                Channels::Tied => writeln!(wgsl, "        sum{k} += dot(adjoint, {moved});"),
                Channels::One(c) => writeln!(wgsl, "        sum{k} += (adjoint * {moved})[{c}];"),
            },
            Gain::Field(input, None) => {
                let name = input.name();
                let _ = writeln!(wgsl, "        let gained_{name} = adjoint * {moved};");
                (0..3).try_for_each(|c| {
                    writeln!(wgsl, "        {name}_gradient[3u * s + {c}u] = gained_{name}[{c}];")
                })
            }
            Gain::Field(input, Some(component)) => writeln!(
                wgsl,
                "        {}_gradient[{}u * s + {component}u] = dot(adjoint, {moved});",
                input.name(),
                self.width(input).unwrap_or(1)
            ),
            Gain::Light(index, place) => {
                let _ = writeln!(wgsl, "        let gained_light{index} = adjoint * {moved};");
                let _ = (0..4).try_for_each(|c| {
                    writeln!(wgsl, "        light{index}_adjoint[4u * s + {c}u] = gained_light{index}[{c}];")
                });
                (0..3).try_for_each(|c| {
                    writeln!(wgsl, "        light{index}_place[3u * s + {c}u] = {place}[{c}];")
                })
            }
        };
    }
}
