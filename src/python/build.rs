//! How a library that Python loads is linked where that differs from others: on macOS.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
