//! Planned rules as arithmetic on numbers, for the processor.
//!
//! The planner chooses rules, and their tangents are made from their text, as for a graphics adapter
//! ([`crate::shader`]). Here that same text becomes a [`graph`] of numbers, in which every number stands once; what
//! no free parameter moves can be cut off and kept ([`cut`]); the rest becomes a [`tape`] of instructions, which
//! runs for one sample in any kind of number ([`evaluate`]) or for many at once in the engine. So no formula is
//! written for the processor alone.
//!
//! - [`graph`]: numbers and what they are made of; equal ones are one
//! - [`native`]: functions that are one instruction
//! - [`lower`]: WGSL functions called on graphs
//! - [`shading`]: the value of a plan and how it moves, as a graph; `error`: why it cannot be
//! - [`levels`]: passes over stored texels, as graphs
//! - [`cut`]: what stays from pass to pass
//! - [`steps`]: a graph evaluated node by node, in any kind of number
//! - [`tape`]: instructions over registers, which `writer` finds; `blocks`, `order`: so that few of them are in use at once
//! - [`families`]: what is the same but for the member of a family; `rolled`: such instructions as a loop
//! - [`evaluate`]: a tape run for one sample; [`mod@print`]: a tape as Rust

mod blocks;
pub mod cut;
mod draft;
mod error;
pub mod evaluate;
pub mod families;
pub mod graph;
mod level_then;
pub mod levels;
pub mod lower;
pub mod native;
mod order;
pub mod print;
mod rolled;
pub mod shading;
pub mod steps;
pub mod tape;
mod writer;
