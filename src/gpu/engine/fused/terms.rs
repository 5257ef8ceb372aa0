//! The shader that keeps terms.

use std::fmt::Write as _;

use super::layout::{Layout, fields_read};
use super::{Fitted, WORKGROUP, facts};
use crate::model::params::Param;
use crate::records::StoredRecords;
use crate::samples::LANES;
use crate::shader::Domain;
use crate::shader::emit::{Plan, sample_fields};
use crate::shader::facts::{Facts, Source};
use crate::shader::kept::{held, plan_terms};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::search::components;

/// The parameters that terms are made with.
///
/// # Errors
/// When no rules yield the terms; in words.
pub fn held_parameters(fitted: &Fitted) -> Result<Vec<Param>, String> {
    // Turned or not, as another point may be.
    held(&Facts { turned: true, ..facts(fitted) }).map_err(|error| error.to_string())
}

/// The shader that makes records of terms from records of samples, one sample a thread; and its plan, whose
/// constants and resources are group 0. Bindings of group 1: the count of samples, samples, terms. Terms that are
/// [in place](Layout::in_place_of) have no binding: each thread puts them where its sample's numbers were.
///
/// # Errors
/// When no rules yield the terms; in words.
pub fn terms_module(fitted: &Fitted, terms: &Layout) -> Result<(Plan, String), String> {
    let facts = facts(fitted);
    let (plan, wanted) = plan_terms(&facts).map_err(|error| error.to_string())?;
    let fields: Vec<_> = sample_fields(&Facts { source: Source::Samples, ..facts })
        .into_iter()
        .map(|(name, kind)| (name.to_owned(), kind))
        .collect();
    let (into, buffers) = if terms.in_place_of(&fitted.layout) {
        ("samples", "@group(1) @binding(1) var<storage, read_write> samples: array<f32>;")
    } else {
        (
            "terms",
            "@group(1) @binding(1) var<storage, read> samples: array<f32>;\n\
             @group(1) @binding(2) var<storage, read_write> terms: array<f32>;",
        )
    };
    let mut wgsl = plan.declarations(true);
    wgsl.push_str(&sample_struct(&fields));
    let _ = write!(
        wgsl,
        "\n@group(1) @binding(0) var<uniform> count: vec4u;\n\
         {buffers}\n\n\
         @compute @workgroup_size({WORKGROUP})\nfn cs_main(\n    @builtin(global_invocation_id) id: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {{\n\
         \x20   for (var i = id.x; i < count.x; i += {WORKGROUP}u * workgroups.x) {{\n\
         \x20   let record = i / {LANES}u;\n    let lane = i % {LANES}u;\n",
    );
    let samples = fitted.layout.stored();
    let stored = StoredRecords { name: into, rows: terms.rows };
    wgsl.push_str(&fields_read(&fitted.layout, &fields, "record", |place| samples.number("record", place)));
    // Everything is read before anything is written.
    if let Some(share) = fitted.layout.share {
        let _ = writeln!(wgsl, "    let share = {};", samples.number("record", share));
    }
    wgsl.push_str(&plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
    for (name, kind) in wanted {
        let Some(place) = terms.place(name) else { continue };
        let value = if fields.iter().any(|(field, _)| *field == name) {
            format!("at.{name}")
        } else {
            name.to_owned()
        };
        for k in 0..components(kind) {
            let component = if kind == "f32" { String::new() } else { format!("[{k}]") };
            let _ = writeln!(wgsl, "    {} = {value}{component};", stored.number("record", place + k));
        }
    }
    if let Some(place) = terms.share {
        let _ = writeln!(wgsl, "    {} = share;", stored.number("record", place));
    }
    wgsl.push_str("    }\n}\n");
    Ok((plan, wgsl))
}
