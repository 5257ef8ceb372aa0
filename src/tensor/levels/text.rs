//! The modules of passes backwards: the rules' [text](crate::shader::atlas::adjoint), and what becomes of it.

use std::fmt::Write as _;

use wgpu::BindingType;

use crate::inputs::Input;
use crate::model::params::{Channels, Column};
use crate::pass::WRITE;
use crate::shaded::Scatter;
use crate::shader::atlas::adjoint::{Mover, PassAdjoint};

/// What is bound after the four buffers of every pass over the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bound {
    /// What levels get, three numbers a place, one level after another.
    Adjoints,
    /// The largest number that a blur gives, and the sums of what it does.
    Largest,
    Sums,
    /// The columns' sums, of each covered texel.
    ByColumns,
    /// What an input gets.
    Gradient(Input),
}

/// What becomes of what a seed gets.
#[derive(Clone, Debug)]
pub(super) enum Gain {
    /// It is added to these columns'.
    Columns(Vec<usize>),
    /// It is the texel's.
    Input(Input),
}

/// Where what levels get begins, as a number of texels.
pub(super) type Places<'a> = &'a dyn Fn(&str) -> usize;

/// A module.
pub(super) struct Module {
    pub(super) wgsl: String,
    pub(super) bound: Vec<Bound>,
}

impl Module {
    /// Of a pass backwards; `seeds` say what becomes of what each gets, and of the columns there are these.
    pub(super) fn new(
        pass: &PassAdjoint,
        (seeds, columns): (&[Gain], &[Column]),
        places: Places<'_>,
        (scatter, headroom): (Scatter, u32),
    ) -> Self {
        let mut text = Text { bound: vec![Bound::Adjoints], lines: String::new() };
        if pass.source.is_some() {
            text.bound.extend([Bound::Largest, Bound::Sums]);
        } else {
            for (leaf, level) in pass.leaves.iter().enumerate() {
                let at = format!("{}u + 3u * u32(here.y * SIZE + here.x)", 3 * places(&level.name));
                let _ = writeln!(text.lines, "    let at_{leaf} = {at};");
                let number = |c| format!("adjoints[at_{leaf} + {c}u]");
                let _ = writeln!(
                    text.lines,
                    "    let gained_{leaf} = vec3f({}, {}, {});",
                    number(0),
                    number(1),
                    number(2)
                );
            }
        }
        for (n, moved) in pass.moved.iter().enumerate() {
            let gained =
                if pass.source.is_some() { "adjoint".to_owned() } else { format!("gained_{}", moved.leaf) };
            let _ = writeln!(text.lines, "    let gain_{n}: vec3f = {gained} * ({});", moved.value);
            match &moved.by {
                Mover::Seed(k) => text.gain(n, &seeds[*k], columns),
                Mover::Level(name, component) => {
                    let at = format!("{}u + 3u * u32(here.y * SIZE + here.x)", 3 * places(name) + component);
                    let _ = writeln!(text.lines, "    adjoints[{at}] += {};", all(n));
                }
            }
        }
        let mut wgsl = pass.declarations.clone();
        for (binding, bound) in (4..).zip(&text.bound) {
            let _ = writeln!(
                wgsl,
                "@group(1) @binding({binding}) var<storage, read_write> {};",
                match bound {
                    Bound::Adjoints => "adjoints: array<f32>".to_owned(),
                    Bound::Largest => "largest: atomic<u32>".to_owned(),
                    Bound::Sums => "sums: array<atomic<u32>>".to_owned(),
                    Bound::ByColumns => "by_columns: array<f32>".to_owned(),
                    Bound::Gradient(input) => format!("{}_gradient: array<f32>", input.name()),
                }
            );
        }
        if pass.source.is_some() {
            wgsl.push_str(&given(3 * places(&pass.leaves[0].name), scatter, headroom));
        }
        wgsl.push_str(&pass.entry);
        wgsl.push_str(&text.lines);
        wgsl.push_str("}\n");
        Self { wgsl, bound: text.bound }
    }

    /// How the buffers beside those of every pass are bound.
    pub(super) fn kinds(&self) -> Vec<BindingType> {
        vec![WRITE; self.bound.len()]
    }
}

/// The sum of a gain's numbers.
fn all(n: usize) -> String {
    format!("dot(gain_{n}, vec3f(1.0))")
}

/// The functions of a blur: what its leaf got at a place, and how it gives to what it reads.
fn given(leaf: usize, scatter: Scatter, headroom: u32) -> String {
    let add = match scatter {
        Scatter::Exact => format!("add_exactly(at + c, number[c], power_of_two(unit_exponent({headroom})))"),
        Scatter::Fast => "add_fast(at + c, number[c])".to_owned(),
    };
    format!(
        "{}\nfn gained(place: vec2i) -> vec3f {{\n    let at = {leaf}u + 3u * u32(place.y * SIZE + place.x);\n    \
         return vec3f(adjoints[at], adjoints[at + 1u], adjoints[at + 2u]);\n}}\n\n\
         fn give(place: vec2i, number: vec3f) {{\n    let at = 3u * u32(place.y * SIZE + place.x);\n    \
         for (var c = 0u; c < 3u; c++) {{\n        {add};\n    }}\n}}\n",
        include_str!("../atomic_sums.wgsl")
    )
}

struct Text {
    bound: Vec<Bound>,
    lines: String,
}

impl Text {
    fn bind(&mut self, bound: Bound) {
        if !self.bound.contains(&bound) {
            self.bound.push(bound);
        }
    }

    /// The lines that take the `n`-th gain to where it is wanted.
    fn gain(&mut self, n: usize, gain: &Gain, columns: &[Column]) {
        match gain {
            Gain::Columns(of) => {
                self.bind(Bound::ByColumns);
                for &k in of {
                    let number = match columns[k].channels {
                        Channels::Tied => all(n),
                        Channels::One(c) => format!("gain_{n}[{c}]"),
                    };
                    let count = columns.len();
                    let _ = writeln!(self.lines, "    by_columns[{count}u * i + {k}u] += {number};");
                }
            }
            Gain::Input(input) => {
                self.bind(Bound::Gradient(*input));
                let (name, width) = (input.name(), input.width().unwrap_or(1));
                if width == 1 {
                    let _ = writeln!(self.lines, "    {name}_gradient[i] += {};", all(n));
                    return;
                }
                // Channels never mix: all of them have moved at once.
                for c in 0..width {
                    let _ =
                        writeln!(self.lines, "    {name}_gradient[{width}u * i + {c}u] += gain_{n}[{c}];");
                }
            }
        }
    }
}
