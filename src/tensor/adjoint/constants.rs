//! The module that fills a plan's constants from tensors.

use std::fmt::Write as _;

use crate::model::params::{Channels, Column, Param};
use crate::shader::quantity::Constant;

/// The module that fills a plan's block of constants from the columns: entry point `cs_main`, one thread. In
/// group 0: the columns, the parameters' values (a `vec4f` each), and the block.
#[must_use]
pub fn module_of(constants: &[Constant], columns: &[Column]) -> String {
    let mut wgsl = String::new();
    if !columns.is_empty() {
        wgsl.push_str("@group(0) @binding(0) var<storage, read_write> columns: array<f32>;\n");
    }
    wgsl.push_str(
        "@group(0) @binding(1) var<storage, read> values: array<vec4f>;\n\
        @group(0) @binding(2) var<storage, read_write> block: array<vec4f>;\n\n\
        @compute @workgroup_size(1)\nfn cs_main() {\n    const DEGREE = 0.017453292;\n",
    );
    for param in Param::all() {
        let _ = writeln!(wgsl, "    var {} = values[{}];", param.identifier(), param.index());
    }
    for (k, column) in columns.iter().enumerate() {
        let name = column.param.identifier();
        let _ = match column.channels {
            Channels::Tied => writeln!(wgsl, "    {name} = vec4f(vec3f(columns[{k}]), 0.0);"),
            Channels::One(c) => writeln!(wgsl, "    {name}[{c}] = columns[{k}];"),
        };
    }
    wgsl.push_str(
        "    let turn = DEGREE * environment_rotation.x;\n    let azimuth = DEGREE * key_azimuth.x;\n    let elevation = DEGREE * key_elevation.x;\n",
    );
    for (i, constant) in constants.iter().enumerate() {
        let value = match constant {
            Constant::Param(param) => param.identifier(),
            Constant::Turn => "vec4f(cos(turn), sin(turn), 0.0, 0.0)",
            Constant::KeyDirection => {
                "vec4f(cos(elevation) * sin(azimuth), sin(elevation), cos(elevation) * cos(azimuth), 0.0)"
            }
            Constant::KeyByAzimuth => {
                "DEGREE * vec4f(cos(elevation) * cos(azimuth), 0.0, -cos(elevation) * sin(azimuth), 0.0)"
            }
            Constant::KeyByElevation => {
                "DEGREE * vec4f(-sin(elevation) * sin(azimuth), cos(elevation), -sin(elevation) * cos(azimuth), 0.0)"
            }
            // Of cubes that move: here they are inputs of their own.
            Constant::GlossyPaces => "vec4f()",
            // Of the vertex stage: no plan over samples has them.
            Constant::Eye | Constant::ViewProjection | Constant::MorphWeights => "vec4f()",
        };
        let _ = writeln!(wgsl, "    block[{i}] = {value};");
    }
    wgsl.push_str("}\n");
    wgsl
}
