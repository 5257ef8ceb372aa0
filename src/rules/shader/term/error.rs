//! What is wrong with a file of rules.

/// A file of rules that cannot be used: where, what is wrong, and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {problem}. {}.", problem.remedy())]
pub struct TermError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: Problem,
}

/// What is wrong with a file of rules.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's text says what its fields are")]
pub enum Problem {
    #[error("`{0}` is neither a comment nor a function")]
    Stray(String),
    #[error("the function does not end")]
    Endless,
    #[error("the function's head is not `fn name(a: f32, b: vec3f) -> vec3f {{`")]
    Head,
    #[error("unknown key `{given}`")]
    Key { given: String, nearest: Option<&'static str>, known: &'static [&'static str] },
    #[error("`{key}: {given}` cannot be read")]
    Value { key: &'static str, given: String, wanted: &'static str },
    #[error("the function {function} has no `{key}:`")]
    Lacks { function: String, key: &'static str },
    #[error("`{key}:` stands after a function, or twice")]
    Misplaced { key: &'static str },
    #[error("`{0}` is no name")]
    Name(String),
    #[error("`{0}` is a name that the shaders give themselves")]
    Reserved(String),
    #[error("the {kind} `{name}` is there already")]
    Taken { kind: &'static str, name: String },
    #[error("there may be {most} {kind}s, no more")]
    Full { kind: &'static str, most: usize },
    #[error("the file declares no effect")]
    NoEffect,
    #[error("no rule adds anything to the radiance")]
    NothingAdded,
    #[error("{quantity} is added to the radiance, but is {given}")]
    NoRadiance { quantity: String, given: String },
    #[error("nothing gives {quantity}")]
    Unknown { quantity: String, near: Vec<String> },
    #[error(
        "{quantity} is there for rasterised fragments alone, not for the stored samples that a fit reads"
    )]
    RasterOnly { quantity: String },
    #[error("{quantity} is not there for texels of the atlas")]
    NotOfTexels { quantity: String },
    #[error("{quantity} is there for texels alone")]
    TexelsAlone { quantity: String },
    #[error("`{key}:` belongs to a rule of texels alone")]
    OfTexels { key: &'static str },
    #[error("the function of a pass is not its kernel")]
    Kernel,
    #[error("{quantity} is a {kind}, which a texel of the atlas does not hold")]
    NoLevel { quantity: String, kind: String },
    #[error("{quantity} is of the type {given} here, but it is {wanted}")]
    Type { quantity: String, given: String, wanted: String },
    #[error("the rules need one another in a circle: {0}")]
    Circle(String),
    #[error("`{key}: {name}` names what is not there")]
    NotThere { key: &'static str, name: String, known: Vec<String> },
    #[error("{0} is declared, but used by no rule")]
    Idle(String),
    #[error("nothing finds {0} at samples")]
    Unfound(String),
    #[error("it is no valid WGSL: {0}")]
    Wgsl(String),
    #[error("{0} has no derivative here")]
    Derivative(String),
}

impl Problem {
    /// What to do about it, without the final stop.
    #[must_use]
    pub fn remedy(&self) -> String {
        let known = |names: &[String]| format!("Known: {}", names.join(", "));
        match self {
            Self::Stray(_) => "Write declarations as comments above a function; constants belong into it".to_owned(),
            Self::Endless => "End it with a line that is `}`".to_owned(),
            Self::Head => "Write it so, each parameter named as the quantity that it is".to_owned(),
            Self::Key { nearest: Some(nearest), .. } => format!("Did you mean `{nearest}`"),
            Self::Key { known, .. } => {
                format!("Keys are {}; prose has no single small word before a colon", known.join(", "))
            }
            Self::Value { wanted, .. } => format!("Write {wanted}"),
            Self::Lacks { key, .. } => format!("Add a line `// {key}: ...` above it"),
            Self::Misplaced { .. } => "Write it once, above the first function".to_owned(),
            Self::Name(_) => {
                "Use lower-case letters, digits and single `_`, a letter first; it must mean nothing else in the \
                 shaders"
                    .to_owned()
            }
            Self::Reserved(_) => {
                "Give it another name: those that begin with `d_` or end in `_level`, `_along_u` or `_dilated` are of \
                 levels of the atlas, and sample_level, vs_main, fs_main and cs_main are functions"
                    .to_owned()
            }
            Self::Taken { .. } => "Give it another name".to_owned(),
            Self::Full { .. } => "Use fewer of them in one process".to_owned(),
            Self::NoEffect => "Add a line `// effect: NAME, what it shows`".to_owned(),
            Self::NothingAdded => "Add a line `// adds: NAME` above the function that gives the term's light".to_owned(),
            Self::NoRadiance { .. } => "Give one vec3f, linear Rec.709 radiance".to_owned(),
            Self::Unknown { near, .. } if !near.is_empty() => {
                format!("Did you mean {}? Or write a rule that gives it", near.join(" or "))
            }
            Self::Unknown { .. } => "Write a rule that gives it, or declare it as a parameter".to_owned(),
            Self::RasterOnly { .. } => "Use what fragments and samples both have, such as n, view or albedo".to_owned(),
            Self::NotOfTexels { .. } => {
                "A texel is lit, not seen: use what no eye moves, such as n, irradiance or albedo, or write a rule with \
                 `domain: texel` that gives it"
                    .to_owned()
            }
            Self::TexelsAlone { .. } => {
                "Add `// sampled: ERROR` to the rule that gives it, or `// domain: texel, fragment`".to_owned()
            }
            Self::OfTexels { .. } => "Add a line `// domain: texel` above it".to_owned(),
            Self::Kernel => {
                "Let it give one quantity, take `tap: f32` (and `axis: vec2f`), and return a vec2f: how many texels \
                 away a tap is, and what it weighs"
                    .to_owned()
            }
            Self::NoLevel { .. } => "Make it an f32, a vec2f or a vec3f".to_owned(),
            Self::Type { wanted, .. } => format!("Make it {wanted}"),
            Self::Circle(_) => "Take one of the needs out".to_owned(),
            Self::NotThere { known: names, .. } => known(names),
            Self::Idle(_) => "Name it among a function's parameters, or take it out".to_owned(),
            Self::Unfound(_) => "Declare it by `field:`, and give the mesh an attribute of its name".to_owned(),
            Self::Wgsl(_) => "Correct the function".to_owned(),
            Self::Derivative(_) => "Write it with what rules use: arithmetic, vectors, built-in functions".to_owned(),
        }
    }

    /// At a line.
    pub(super) const fn at(self, line: usize) -> TermError {
        TermError { line, problem: self }
    }
}
