//! The `skinfit` command.

fn main() -> std::process::ExitCode {
    skinfit::cli::main()
}
