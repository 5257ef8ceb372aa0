//! `skinfit page`: a scene or a run as a page that a browser opens from disk.
//!
//! - `taken`: the files that the page takes along

mod taken;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use super::opened::{SceneOrRun, run_of};
use super::scene::BakeArguments;
use super::{Exit, Refusal, say, unfinished};
use crate::output;
use crate::prepare::scene_names;
use taken::taken;

/// The page without a scene, beside the program.
const PLAYER: &str = "skinfit-page.html";
/// Where it takes a scene, and its title.
const MARKS: [&str; 2] = ["{{scene}}", "{{title}}"];
/// What of a report is replaced by a link to the page: an earlier one, or the end of its head.
const LINK: (&str, &str) = ("<p class=\"page\">", "</p>");
const HEAD: &str = "</header>";
/// The report beside which a page is linked.
const REPORT: &str = "report.html";

/// Write a scene or a run as a page: sliders, fits and all, in a browser, from disk
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("The page is one file that opens without a server. It draws with WebGPU, or on the processor where a browser has none, and fits on the processor. It holds the scene's files, so whoever has the page has these. Bakes of the scene's effects are in it; what other effects ask for is baked in the browser.\n\nExamples:\n  skinfit page                         the built-in scene, as runs/builtin/page.html\n  skinfit page runs/a                  a run: its scene, its constants; its report links to the page\n  skinfit page runs/a --compare runs/b   beside another\n  skinfit page noon.toml night.toml    one skin in two lights\n  skinfit page scene.toml -o fit.html")
)]
pub(super) struct Arguments {
    /// The scene file, several that share one skin, or the run folder of a fit; the built-in scene when left out.
    #[arg(value_name = "SCENE|RUN")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    bakes: BakeArguments,
    /// Begin with these constants: a params.toml, or the run folder that has one [default: those of the run].
    #[arg(long, value_name = "FILE|RUN")]
    params: Option<PathBuf>,
    /// Another run beside them: its folder, or a params.toml.
    #[arg(long, value_name = "RUN|FILE")]
    compare: Option<PathBuf>,
    /// The file to write [default: page.html in the run folder].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// What is above the page [default: the scene's name].
    #[arg(long, value_name = "WORDS")]
    title: Option<String>,
    /// The page without a scene, as `src/page/build` makes it [default: skinfit-page.html beside the program].
    #[arg(long, value_name = "FILE")]
    player: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let player = player(arguments.player.as_deref())?;
    let mut of = SceneOrRun::of(&arguments.scenes)?;
    if let Some(params) = &arguments.params {
        of.fitted = Some(run_of(params)?);
    }
    let other = arguments.compare.as_deref().map(run_of).transpose()?;
    let scratch = unfinished::scratch()?;
    let scenes = arguments.bakes.kept_paths(&of.scenes, scratch.path())?;
    // Bakes are taken along as the cache has them.
    let cache = arguments.bakes.cache().unwrap_or_else(|| scratch.path().join("bakes"));
    let archive = taken(&scenes, [of.fitted.as_ref(), other.as_ref()], &cache)?;
    let packed = gzip(&archive)?;
    let title = arguments.title.clone().unwrap_or_else(|| title(&of));
    let page = player.replacen(MARKS[0], &BASE64_STANDARD.encode(packed), 1);
    let page = page.replace(MARKS[1], &escaped(&title));
    let file = arguments.output.clone().unwrap_or_else(|| of.folder().join("page.html"));
    output::write(&file, page.as_bytes())?;
    let mebibytes = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let (whole, own) = (mebibytes(page.len()), mebibytes(player.len()));
    say(&format!("wrote {} ({whole:.1} MiB, of which the scene has {:.1})", file.display(), whole - own))?;
    if let Some(run) = &of.run {
        link(&run.join(REPORT), &file)?;
    }
    Ok(Exit::Done)
}

/// The page without a scene.
fn player(given: Option<&Path>) -> Result<String, Refusal> {
    let beside = || std::env::current_exe().ok().and_then(|program| Some(program.parent()?.join(PLAYER)));
    let Some(path) = given.map(Path::to_owned).or_else(beside) else {
        return Err(Refusal::new(format!(
            "{PLAYER}: the program does not know where it is. Name it: --player FILE."
        )));
    };
    let text = std::fs::read_to_string(&path).map_err(|error| {
        Refusal::new(format!(
            "{}: the page without a scene cannot be read: {error}. `src/page/build` in the sources makes it, beside the \
             program; --player FILE names another place.",
            path.display()
        ))
    })?;
    match MARKS.iter().all(|mark| text.contains(mark)) {
        true => Ok(text),
        false => Err(Refusal::new(format!(
            "{}: this is no page without a scene. Name one that `src/page/build` has made.",
            path.display()
        ))),
    }
}

fn gzip(bytes: &[u8]) -> Result<Vec<u8>, Refusal> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(gzip.finish()?)
}

/// The names of the run or the scenes, and of no folder that these are in.
fn title(of: &SceneOrRun) -> String {
    let folder = of.folder();
    let name = match &of.scenes[..] {
        [] => "the built-in scene".to_owned(),
        scenes @ [_, _, ..] if of.run.is_none() => scene_names(scenes).unwrap_or_default().join(", "),
        _ => folder.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    };
    format!("skinfit: {name}")
}

/// As text of HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Have a run's report link to the page, where there is a report.
fn link(report: &Path, page: &Path) -> Result<(), Refusal> {
    let Ok(text) = std::fs::read_to_string(report) else { return Ok(()) };
    let (begin, end) = LINK;
    // What an earlier page left goes.
    let text = match text.split_once(begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)))
    {
        Some((before, after)) => format!("{before}{after}"),
        None => text,
    };
    let Some(at) = text.find(HEAD) else { return Ok(()) };
    let address = address(page, report);
    let words = format!(
        "{begin}<a href=\"{}\">Move its constants, and fit it again, in the browser</a>{end}",
        escaped(&address)
    );
    let (before, after) = text.split_at(at);
    output::write(report, format!("{before}{words}{after}").as_bytes())?;
    Ok(())
}

/// A page's address in a report: the way from the one to the other.
fn address(page: &Path, report: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let (page, report) = (whole(page), whole(report));
    let folder = report.parent().unwrap_or(Path::new(""));
    let shared = page.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| "..".to_owned());
    let down = page.components().skip(shared).map(|part| encoded(&part.as_os_str().to_string_lossy()));
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// A name as part of an address.
fn encoded(name: &str) -> String {
    const KEPT: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');
    utf8_percent_encode(name, KEPT).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_links_to_the_last_page_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (report, page) = (folder.path().join(REPORT), folder.path().join("a page#1.html"));
        std::fs::write(&report, "<header><h1>run</h1></header><main></main>").unwrap();
        std::fs::write(&page, "").unwrap();
        link(&report, &folder.path().join("earlier.html")).unwrap();
        link(&report, &page).unwrap();
        let text = std::fs::read_to_string(&report).unwrap();
        assert!(text.contains("<a href=\"a%20page%231.html\">") && !text.contains("earlier"), "{text}");
        assert!(
            text.ends_with("</header><main></main>") && text.matches("class=\"page\"").count() == 1,
            "{text}"
        );
        assert_eq!(address(Path::new("/a/b/p.html"), Path::new("/a/c/d/report.html")), "../../b/p.html");
        // Without a report there is nothing to link.
        link(&folder.path().join("none.html"), &page).unwrap();
    }

    #[test]
    fn a_player_is_told_from_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("some.html");
        let missing = player(Some(&file)).unwrap_err();
        assert!(missing.words.contains("src/page/build"), "{}", missing.words);
        std::fs::write(&file, "<html></html>").unwrap();
        assert!(player(Some(&file)).unwrap_err().words.contains("no page without a scene"));
        std::fs::write(&file, MARKS.join(" ")).unwrap();
        assert!(player(Some(&file)).is_ok());
    }
}
