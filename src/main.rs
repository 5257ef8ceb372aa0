//! The `skinfit` command.

fn main() -> std::process::ExitCode {
    skinfit_host::cli::main()
}
