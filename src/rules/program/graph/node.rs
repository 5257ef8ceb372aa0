//! What a graph consists of: nodes, the operations that they are, and inputs.

/// A node's place in its graph. Operands have smaller ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub(in crate::program) u32);

impl Id {
    /// Its place.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// An operation on one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "named as in mathematics")]
pub enum Unary {
    Negate,
    Abs,
    Sqrt,
    Reciprocal,
    Floor,
    Exp2,
    Log2,
    /// 1 where the number is neither NaN nor infinite, else 0.
    IsFinite,
}

/// An operation on two numbers. Truth is 1, falsehood 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "named as in mathematics")]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Min,
    Max,
    /// `a < b`
    Less,
    /// `a >= b`
    GreaterEqual,
}

/// A function of several numbers that runs as one instruction ([`crate::program::native`]). It has parts, and for
/// each vector that its arguments move along more of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Native {
    /// `normalize_or` of a vector; after it the fallback, which is seldom asked for.
    Unit,
    /// `cube_place_of_unit` of a direction: face, s, t.
    Place,
    /// A bilinear lookup in padded cube faces, at (face, s, t): the four channels. Which faces: the place among
    /// [`Graph::resources`](super::Graph::resources).
    Lookup(u32),
}

impl Native {
    /// How many numbers it takes, how many of them can move, and how many it yields: of the value, and along each
    /// vector that the arguments move.
    #[must_use]
    pub const fn widths(self) -> Widths {
        match self {
            Self::Unit => Widths { arguments: 6, moving: 3, parts: 3, slopes: 3 },
            Self::Place => Widths { arguments: 3, moving: 3, parts: 3, slopes: 2 },
            Self::Lookup(_) => Widths { arguments: 3, moving: 2, parts: 4, slopes: 4 },
        }
    }

    /// Which of its arguments are asked for only where the others leave nothing: those from here on.
    #[must_use]
    pub const fn hot(self) -> usize {
        3
    }
}

/// How many numbers a [`Native`] takes and yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "told by Native::widths")]
pub struct Widths {
    pub arguments: usize,
    pub moving: usize,
    pub parts: usize,
    pub slopes: usize,
}

/// A call of a [`Native`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Call {
    /// The function.
    pub native: Native,
    /// Its arguments.
    pub arguments: Vec<Id>,
    /// What its arguments move along, where the call is for how the value moves; else nothing.
    pub along: Vec<Id>,
}

/// One number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// The bits of an f64.
    Constant(u64),
    /// A number of the sample, by its place among [`Graph::fields`](super::Graph::fields).
    Field(u32),
    /// A number that is the same for all samples of a pass, by its place among [`Graph::uniforms`](super::Graph::uniforms).
    Uniform(u32),
    /// An operation on one number.
    Unary(Unary, Id),
    /// An operation on two.
    Binary(Binary, Id, Id),
    /// `yes` where the condition is not 0, else `no`.
    Select {
        /// 0 or 1.
        condition: Id,
        /// Where it is 1.
        yes: Id,
        /// Where it is 0.
        no: Id,
    },
    /// A call, by its place among the graph's calls. Its numbers are read by [`Node::Part`]s.
    Call(u32),
    /// One of a call's numbers.
    Part(Id, u8),
}

/// One number of something that has a name: a field `base` has the components 0 to 2.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Input {
    /// The name in the rules.
    pub name: String,
    /// Which of its numbers.
    pub component: usize,
}
