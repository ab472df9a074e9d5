//! Builds of real meshes against the papers' figures that depend only on mesh and algorithm.

use xylem::run::{self, BuildOptions};
use xylem::scene::{self, LoadOptions};

#[test]
fn the_bunny_has_the_papers_leaves_and_traffic() {
    let Ok(mesh) = scene::load("bunny", &LoadOptions::default()) else {
        println!(
            "skipped: the_bunny_has_the_papers_leaves_and_traffic: no bunny; set XYLEM_SCENES"
        );
        return;
    };
    let run = run::build(&mesh.triangles, &BuildOptions::default()).unwrap();
    let tree = run.scene.tree;
    let quality = run.check().unwrap();
    let total = run.traffic.total();
    println!(
        "{} {} {} {} {:?} {:?}",
        tree.leaf_count,
        tree.node_count,
        total.bytes(),
        quality.sah_cost(),
        quality,
        run.host_time
    );
    let mib = total.bytes() as f64 / f64::from(1 << 20);
    assert!((10.55..10.70).contains(&mib), "{mib}");
    assert!((64_709..=66_015).contains(&tree.leaf_count));
}
