//! A sweep under a real scheduler: Slurm, with its controller and two nodes on this machine.
//!
//! The daemons run from a folder of their own, on free ports, as whoever runs the tests, without systemd, and
//! end with the test. `tests/run` installs them from the Debian or Ubuntu archive.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::cli::sandbox::{Ran, Sandbox};

/// Nothing here takes longer, even where all cores are busy.
const PATIENCE: Duration = Duration::from_secs(240);

/// Ask again until there is an answer.
#[track_caller]
fn poll<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let since = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(since.elapsed() < PATIENCE, "{what}: still not after {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// A daemon in the foreground, with what it says in a file; it ends with its handle.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A program of the scheduler's; daemons stand outside of a user's search path.
fn program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin".into(), "/sbin".into()]);
    folders.map(|folder| folder.join(name)).find(|place| place.is_file())
}

/// A controller and two nodes.
struct Slurm {
    folder: tempfile::TempDir,
    nodes: [Option<Daemon>; 2],
    controller: Option<Daemon>,
}

const NODES: [&str; 2] = ["one", "two"];

impl Slurm {
    /// Start it; `None`, said loudly, where `SKINFIT_NO_SCHEDULER_TESTS` allows that it is missing.
    fn start() -> Option<Self> {
        for name in ["slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "scancel"] {
            if program(name).is_some() {
                continue;
            }
            let words = format!(
                "{name} is not there. tests/run installs it where it can (slurmctld, slurmd and slurm-client of \
                 Debian and Ubuntu); SKINFIT_NO_SCHEDULER_TESTS=1 leaves the tests under a scheduler out."
            );
            if std::env::var_os("SKINFIT_NO_SCHEDULER_TESTS").is_some() {
                crate::common::not_checked(&format!("SKINFIT_NO_SCHEDULER_TESTS is set: {words}"));
                return None;
            }
            panic!("{words}");
        }
        let mut slurm = Self { folder: tempfile::tempdir().unwrap(), nodes: [None, None], controller: None };
        slurm.configure();
        slurm.controller = Some(slurm.daemon("slurmctld", &["-D", "-i"]));
        for node in 0..2 {
            slurm.start_node(node);
        }
        for node in 0..2 {
            slurm.wait_for_node(node);
        }
        Some(slurm)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn configure(&self) {
        let user = output(Command::new("id").arg("-un")).trim().to_owned();
        let host = output(Command::new("hostname").arg("-s")).trim().to_owned();
        // Held until all are drawn, so that none is drawn twice.
        let sockets = [(); 3].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
        let [controller, one, two] = sockets.each_ref().map(|socket| socket.local_addr().unwrap().port());
        let folder = self.folder.path().display();
        std::fs::create_dir_all(self.path("state")).unwrap();
        // No authentication, so that no daemon and no key is needed for it: everything stays on this machine.
        // A node that does not answer is given up after some seconds, and its jobs are queued again at once.
        let text = format!(
            "ClusterName=skinfit\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={controller}\n\
             AuthType=auth/none\nCredType=cred/none\nAuthInfo=cred_expire=5\nSlurmUser={user}\nSlurmdUser={user}\n\
             StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool-%n\n\
             SlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd-%n.pid\n\
             ProctrackType=proctrack/pgid\nTaskPlugin=task/none\nSwitchType=switch/none\nMpiDefault=none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nSchedulerType=sched/builtin\n\
             AccountingStorageType=accounting_storage/none\nJobAcctGatherType=jobacct_gather/none\n\
             JobRequeue=1\nReturnToService=2\nSlurmctldTimeout=10\nSlurmdTimeout=5\nInactiveLimit=0\n\
             KillWait=1\nMinJobAge=600\nMailProg=/bin/true\n\
             NodeName=one NodeHostname={host} NodeAddr=127.0.0.1 Port={one} CPUs=1 State=UNKNOWN\n\
             NodeName=two NodeHostname={host} NodeAddr=127.0.0.1 Port={two} CPUs=1 State=UNKNOWN\n\
             PartitionName=main Nodes=one,two Default=YES MaxTime=INFINITE State=UP\n"
        );
        std::fs::write(self.path("slurm.conf"), text).unwrap();
    }

    fn command(&self, name: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program(name).unwrap());
        command.args(arguments).env("SLURM_CONF", self.path("slurm.conf")).stdin(Stdio::null());
        command
    }

    fn daemon(&self, name: &str, arguments: &[&str]) -> Daemon {
        let log = self.path(&format!("{name}-{}.log", arguments.last().unwrap_or(&"")));
        let log = std::fs::OpenOptions::new().create(true).append(true).open(log).unwrap();
        let mut command = self.command(name, arguments);
        Daemon(command.stdout(log.try_clone().unwrap()).stderr(log).spawn().unwrap())
    }

    fn start_node(&mut self, node: usize) {
        std::fs::create_dir_all(self.path(&format!("spool-{}", NODES[node]))).unwrap();
        self.nodes[node] = Some(self.daemon("slurmd", &["-D", "-N", NODES[node]]));
    }

    fn wait_for_node(&self, node: usize) {
        let arguments = ["-h", "-N", "-n", NODES[node], "-o", "%t"];
        poll(&format!("node {} in {}", NODES[node], self.logs()), || {
            let said = self.command("sinfo", &arguments).output().unwrap();
            let state = String::from_utf8_lossy(&said.stdout).trim().to_owned();
            ["idle", "mix", "alloc"].contains(&state.as_str()).then_some(())
        });
    }

    /// What the daemons say, kept where a test fails.
    fn logs(&self) -> String {
        self.folder.path().display().to_string()
    }

    /// The node's daemon is killed, and all that it runs.
    fn kill_node(&mut self, node: usize) {
        drop(self.nodes[node].take());
        let spool = format!("spool-{}", NODES[node]);
        for process in processes(|words| words.contains(&spool) && words.contains("slurm_script")) {
            // The keeper of the step, the script, and what it started, which is its process group.
            for victim in [process.parent, process.id] {
                let _ =
                    Command::new("kill").args(["-KILL", &victim.to_string()]).stderr(Stdio::null()).status();
            }
            let group = format!("-{}", process.id);
            let _ = Command::new("kill").args(["-KILL", "--", &group]).stderr(Stdio::null()).status();
        }
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        let _ = self.command("scancel", &["--full", "--state=RUNNING"]).stderr(Stdio::null()).status();
        (0..2).for_each(|node| self.kill_node(node));
        if let Some(controller) = &self.controller {
            // It has a helper process that ends with it only when it is asked to.
            let id = controller.0.id().to_string();
            let _ = Command::new("kill").args(["-TERM", &id]).status();
            let since = Instant::now();
            while Path::new("/proc").join(&id).join("exe").exists()
                && since.elapsed() < Duration::from_secs(10)
            {
                std::thread::sleep(Duration::from_millis(50));
                if let Some(controller) = &mut self.controller
                    && controller.0.try_wait().is_ok_and(|ended| ended.is_some())
                {
                    break;
                }
            }
        }
    }
}

struct Process {
    id: u32,
    parent: u32,
}

/// Processes whose command line, words joined by spaces, is as wanted.
fn processes(wanted: impl Fn(&str) -> bool) -> Vec<Process> {
    let list = output(Command::new("ps").args(["-e", "-o", "pid=,ppid=,args="]));
    let parse = |line: &str| {
        let mut words = line.split_whitespace();
        let (id, parent) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        wanted(&words.collect::<Vec<_>>().join(" ")).then_some(Process { id, parent })
    };
    list.lines().filter_map(parse).collect()
}

fn output(command: &mut Command) -> String {
    String::from_utf8(command.stdin(Stdio::null()).output().unwrap().stdout).unwrap()
}

/// Twelve fits of the small scene; of those that take many starts each takes some seconds.
const PLAN: &str = r#"command = "fit"
scene = "scene.toml"
results = "results"
[settings]
solver = "lm"
starts = 40
[[axis]]
key = "fit.loss"
values = ["l2", "relative_l2", "huber"]
[[axis]]
key = "model.params.rim_exponent"
values = [1.5, 2.5]
[[axis]]
key = "seed"
values = [1, 2]
"#;

fn results(sandbox: &Sandbox) -> usize {
    let entries = std::fs::read_dir(sandbox.path("results")).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("job-")).count()
}

#[test]
fn a_sweep_under_slurm_loses_a_node_and_still_gives_what_a_local_one_gives() {
    let Some(mut slurm) = Slurm::start() else { return };
    // The same sweep here, first.
    let local = Sandbox::new();
    local.write("plan.toml", PLAN.as_bytes());
    local.run(&["sweep", "plan.toml"]).done();
    local.run(&["collect", "plan.toml", "-o", "all.csv"]).done();

    let sandbox = Sandbox::new();
    sandbox.write("plan.toml", PLAN.as_bytes());
    let list = sandbox.run(&["sweep", "plan.toml", "--threads", "1", "--list"]).done().out;
    assert_eq!(list.lines().count(), 12);
    sandbox.write("jobs.txt", list.as_bytes());
    // Each array task takes its line, as docs/sweeps.md has it.
    let script = format!(
        "#!/bin/sh\necho \"$SLURM_ARRAY_TASK_ID $SLURMD_NODENAME\" >> started.txt\n\
         # However fast the machine, a job that just began is there to be lost.\nsleep 1\n\
         export SKINFIT_CACHE='{}'\neval \"$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" jobs.txt)\"\n",
        sandbox.cache().display()
    );
    sandbox.write("sweep.sh", script.as_bytes());
    let folder = sandbox.path("");
    let folder = folder.to_str().unwrap();
    let submitted = slurm
        .command(
            "sbatch",
            &["--parsable", "--requeue", "--array=0-11", "--chdir", folder, "--output=task-%a.txt"],
        )
        .arg(sandbox.path("sweep.sh"))
        .output()
        .unwrap();
    assert!(submitted.status.success(), "{submitted:?} {}", slurm.logs());
    let started = || std::fs::read_to_string(sandbox.path("started.txt")).unwrap_or_default();
    let on_two = || started().lines().filter(|line| line.ends_with(" two")).count();

    // In the middle: something is done, and the second node is at work.
    poll("both nodes at work", || (results(&sandbox) >= 2 && on_two() >= 1).then_some(()));
    let seen = on_two();
    poll("a job that just began on the second node", || (on_two() > seen).then_some(()));
    let before = results(&sandbox);
    slurm.kill_node(1);
    assert!(before < 12, "it was over before the node was killed");
    let after = sandbox.run(&["collect", "plan.toml", "-o", "half.csv"]);
    assert_eq!(after.code, Some(1), "{after:?}");
    assert!(after.err.contains("plan.toml: jobs without a result, by number: "), "{after:?}");
    // It comes back, as a machine does that was started again; its job is queued again by itself.
    slurm.start_node(1);
    poll(&format!("every result; {}", slurm.logs()), || (results(&sandbox) == 12).then_some(()));
    poll("an empty queue", || {
        let queue = slurm.command("squeue", &["-h"]).output().unwrap();
        queue.stdout.is_empty().then_some(())
    });
    let lines = started().lines().count();
    assert!(lines > 12, "no job was started twice, so none was lost with its node: {}", started());
    collected(&sandbox).done();
    assert_eq!(sandbox.text("all.csv"), local.text("all.csv"));
    // Submitted once more, nothing is computed again.
    let content = |sandbox: &Sandbox| skinfit_results(sandbox);
    let kept = content(&sandbox);
    sandbox.run(&["sweep", "plan.toml"]).done();
    assert_eq!(content(&sandbox), kept);
}

fn collected(sandbox: &Sandbox) -> Ran {
    sandbox.run(&["collect", "plan.toml", "-o", "all.csv"])
}

/// The result files' bytes, seconds and all.
fn skinfit_results(sandbox: &Sandbox) -> Vec<(PathBuf, Vec<u8>)> {
    sandbox.files().into_iter().filter(|(path, _)| path.to_string_lossy().contains("/results/job-")).collect()
}
