//! Wrong usage, help, and the form of what is printed.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use super::place::{GOOD, Place, Ran, TRIANGLE};

#[test]
fn wrong_usage_exits_with_2_and_says_what_is_right() {
    let place = Place::new().with("a.obj", TRIANGLE);
    let cases: &[(&[&str], &str)] = &[
        (&["build"], "<SCENE>"),
        (&["build", "a.obj", "--format", "mbvh4"], "[possible values: bvh2, cbvh, cbvh4, cbvh8]"),
        (&["build", "a.obj", "--engine", "gates"], "[possible values: function, cycle]"),
        (&["build", "a.obj", "--compress", "sideways"], "[possible values: topdown, bottomup]"),
        (&["build", "a.obj", "--memory", "dram"], "[possible values: ideal, slow, medium"),
        (&["build", "a.obj", "--format", "bvh2", "--coords", "modulo"], "use --format cbvh"),
        (&["build", "a.obj", "--max-leaf", "256"], "1..=255"),
        (&["build", "a.obj", "--capacity", "1000"], "capacity M must be a power of two"),
        (&["build", "a.obj", "--burst", "3"], "burst B must be a power of two"),
        (&["build", "a.obj", "--record", "pair8", "--morton", "63"], "30-bit Morton codes"),
        (&["build", "a.obj", "--emitter", "sah"], "[possible values: lbvh, ploc]"),
        (&["build", "a.obj", "--radius", "8"], "about --emitter ploc"),
        (&["build", "a.obj", "--emitter", "ploc", "--radius", "17"], "1..=16"),
        (&["build", "a.obj", "--emitter", "ploc", "--chain", "0"], "1..=8"),
        (&["build", "a.obj", "--region-limit", "leaves=4"], "there is no region 'leaves'"),
        (&["trace", "a.obj"], "--rays <FILE>"),
        (&["render", "a.obj", "--out", "a.png", "--size", "4"], "as 640x480"),
        (&["soc", "a.obj", "--engine", "gates"], "[possible values: sim, qemu, picorv32]"),
        (&["soc", "a.obj", "--engine", "qemu", "--memory", "slow"], "--engine sim only"),
        (&["soc", "a.obj", "--cells", "2049"], "more than the firmware's 2048"),
        (&["soc", "a.obj", "--emitter", "ploc"], "with --emitter lbvh only"),
        (&["soc", "a.obj", "--treelet-depth", "3"], "--compress topdown"),
        (&["soc", "a.obj", "--format", "cbvh8"], "--format cbvh or bvh2"),
        (&["soc", "a.obj", "--accelerator", "rtl"], "--engine picorv32"),
        (&["soc", "a.obj", "--accelerator", "model", "--engine", "qemu"], "--engine sim"),
        (
            &["soc", "a.obj", "--accelerator", "model", "--top-level", "binned"],
            "leave out --top-level",
        ),
        (&["soc", "a.obj", "--accelerator", "model", "--animate", "2"], "cannot be used with"),
        (
            &["soc", "a.obj", "--accelerator-config", "huge"],
            "[possible values: small, paper, ecp5]",
        ),
        (&["soc", "a.obj", "--key", "b.obj"], "--animate"),
        (&["soc", "a.obj", "--animate", "0"], "1..=1024"),
        (&["soc", "a.obj", "--animate", "2", "--rebuild-at", "1e9"], "from 0 to 65535"),
        (&["--out", "x", "build", "a.obj"], "belong to the bare `xylem`"),
        (&["bulid"], "build"),
    ];
    for (arguments, says) in cases {
        place.run(arguments).fails_with(2, &[says]);
    }
    assert_eq!(place.files(), ["a.obj"]);
}

#[test]
fn help_fits_100_columns_and_gives_examples() {
    let place = Place::new();
    let commands: &[&[&str]] = &[
        &[],
        &["build"],
        &["trace"],
        &["render"],
        &["soc"],
        &["scene"],
        &["scene", "list"],
        &["scene", "generate"],
        &["scene", "info"],
    ];
    for command in commands {
        for help in ["-h", "--help"] {
            let ran = place.run(&[command, [help].as_slice()].concat());
            assert_eq!(ran.code(), Some(0));
            let out = ran.out();
            let long: Vec<_> = out.lines().filter(|l| l.chars().count() > 100).collect();
            assert!(long.is_empty(), "{command:?}: {long:?}");
            assert!(out.contains("Examples:") || command.len() == 2, "{command:?}");
        }
    }
    // Paths stand on lines of their own, as long as they are.
    let list = place.run(&["scene", "list"]).out();
    let fits = |line: &str| line.chars().count() <= 100 || line.trim_start().starts_with('/');
    assert!(list.lines().all(fits), "{list}");
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let place = Place::new();
    let mut child = place
        .command(&["scene", "list", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command runs");
    drop(child.stdout.take());
    let ran = Ran(child.wait_with_output().expect("the command ends"));
    assert_eq!((ran.code(), ran.message().as_str()), (Some(0), ""));
}

#[test]
fn text_lines_fit_100_columns() {
    let place = Place::new().with("a.obj", TRIANGLE).with_rays("a.rays", &[GOOD]);
    for arguments in [
        &["build", "terrain:6", "--format", "cbvh"][..],
        &["trace", "a.obj", "--rays", "a.rays", "--check"],
        &["scene", "info", "cornell"],
    ] {
        let ran = place.run(arguments);
        assert_eq!(ran.code(), Some(0), "{}", ran.message());
        assert!(BufReader::new(ran.out().as_bytes()).lines().count() >= 4);
        assert!(ran.out().lines().all(|line| line.chars().count() <= 100), "{}", ran.out());
    }
}
