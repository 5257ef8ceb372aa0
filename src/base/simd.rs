//! The instruction sets that kernels are compiled for, and the one that runs.
//!
//! Each costs the compiler half a minute: of x86-64's there are AVX-512 and AVX2, which today's
//! processors have, and SSE2, which all of them have.

pub use fearless_simd::{Level, Simd};

/// Run an expression, generic over the [`Simd`] token that it is given, with the best instructions
/// that the processor has and that kernels are compiled for.
#[macro_export]
macro_rules! with_simd {
    ($level:expr, $simd:ident => $op:expr) => {{
        #[cfg(target_arch = "x86_64")]
        {
            use $crate::simd::{Simd, X86};
            match X86::of($level) {
                X86::Avx512($simd) => $simd.vectorize(
                    #[inline(always)]
                    || $op,
                ),
                X86::Avx2($simd) => $simd.vectorize(
                    #[inline(always)]
                    || $op,
                ),
                X86::Sse2($simd) => $simd.vectorize(
                    #[inline(always)]
                    || $op,
                ),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            ::fearless_simd::dispatch!($level, $simd => $op)
        }
    }};
}

/// The instruction sets of x86-64 that kernels are compiled for.
#[cfg(target_arch = "x86_64")]
#[allow(missing_docs, reason = "named as the instructions")]
#[derive(Clone, Copy, Debug)]
pub enum X86 {
    Avx512(fearless_simd::x86::Avx512),
    Avx2(fearless_simd::x86::Avx2),
    Sse2(fearless_simd::x86::Sse2),
}

#[cfg(target_arch = "x86_64")]
impl X86 {
    /// The best of them at `level`.
    #[inline]
    #[must_use]
    pub fn of(level: Level) -> Self {
        if let Some(simd) = level.as_avx512() {
            return Self::Avx512(simd);
        }
        match (level.as_avx2(), level.as_sse2()) {
            (Some(simd), _) => Self::Avx2(simd),
            (None, Some(simd)) => Self::Sse2(simd),
            (None, None) => unreachable!("x86-64 includes SSE2"),
        }
    }
}

/// Every level that kernels are compiled for and this processor has, the best first. On x86-64 a better one includes
/// those below it, so that an AVX-512 machine can try what AVX2 and SSE2 machines will run.
#[must_use]
pub fn levels() -> Vec<Level> {
    let best = Level::new();
    #[cfg(target_arch = "x86_64")]
    {
        let simd = (best.as_avx512().map(Simd::level), best.as_avx2().map(Simd::level));
        [simd.0, simd.1, best.as_sse2().map(Simd::level)].into_iter().flatten().collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        vec![best]
    }
}

/// The instructions that kernels use at `level`, by name.
#[must_use]
pub fn name(level: Level) -> String {
    #[cfg(target_arch = "x86_64")]
    let name = format!("{:?}", X86::of(level));
    #[cfg(not(target_arch = "x86_64"))]
    let name = format!("{level:?}");
    name.split('(').next().unwrap_or_default().to_owned()
}

/// The SIMD instructions that kernels use on this processor, by name.
#[must_use]
pub fn instructions() -> String {
    name(Level::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_told_apart_and_the_first_is_the_one_that_runs() {
        let names: Vec<String> = levels().into_iter().map(name).collect();
        assert_eq!(names[0], instructions());
        assert!((1..names.len()).all(|i| !names[..i].contains(&names[i])), "{names:?}");
        // All that x86-64 promises is SSE2, which is therefore always among them.
        assert!(
            !cfg!(target_arch = "x86_64") || names.last().is_some_and(|name| name == "Sse2"),
            "{names:?}"
        );
    }
}
