//! The clustering emitter's trees beside those of obvhs' PLOC: the same boxes, one cost function.
//!
//! `cargo test -p xylem-peers --test quality -- --nocapture`, with `XYLEM_SCENES` set to a folder
//! of meshes, prints the table.
//!
//! obvhs gets the boxes of our grid: 24-bit integers are exact in f32. Its trees are measured by our
//! code, with boxes computed anew from the primitives, so nothing is rounded on either side.

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use xylem::baseline::{HostTree, SweepLeaves, sweep};
use xylem::run::{self, BuildOptions};
use xylem::scene::{self, LoadOptions};
use xylem_core::emit::{EmitterKind, PlocConfig};
use xylem_core::geom::{Aabb, Triangle};
use xylem_core::node::{Bvh2Node, Child, NodeIndex, Subtree};

/// obvhs' tree over grid boxes, one primitive a leaf.
fn obvhs_ploc(boxes: &[Aabb], distance: PlocSearchDistance) -> Bvh2 {
    let vector = |corner: [i32; 3]| obvhs_glam::Vec3A::from(corner.map(|c| c as f32));
    let float =
        |b: &Aabb| obvhs::aabb::Aabb::new(vector(b.min.to_array()), vector(b.max.to_array()));
    let own: Vec<_> = boxes.iter().map(float).collect();
    let order = (0..own.len() as u32).collect();
    PlocBuilder::new().build(distance, &own, order, SortPrecision::U64, 0)
}

/// A peer's tree as one of ours, with boxes from its primitives.
fn host_tree(peer: &Bvh2, boxes: &[Aabb]) -> HostTree {
    let mut tree = HostTree::default();
    // Each node twice: first to put its children on the stack, then to take them as subtrees.
    let mut tasks = vec![(0usize, false)];
    let mut done: Vec<Subtree> = Vec::new();
    while let Some((index, visited)) = tasks.pop() {
        let node = &peer.nodes[index];
        let child = node.first_index as usize;
        if node.is_leaf() {
            let first = tree.primitives.len() as u32;
            let end = child + node.prim_count as usize;
            tree.primitives.extend_from_slice(&peer.primitive_indices[child..end]);
            let members = tree.primitives[first as usize..].iter();
            let bounds = members.fold(Aabb::EMPTY, |all, &p| all.union(&boxes[p as usize]));
            done.push(Subtree { bounds, child: Child::Leaf { first, count: node.prim_count } });
        } else if visited {
            let (b, a) = (done.pop().unwrap(), done.pop().unwrap());
            let number = NodeIndex(tree.nodes.len() as u32);
            tree.nodes.push(Bvh2Node { children: [a, b] });
            done.push(Subtree { bounds: a.bounds.union(&b.bounds), child: Child::Inner(number) });
        } else {
            tasks.extend([(index, true), (child + 1, false), (child, false)]);
        }
    }
    tree.root = done.pop();
    tree
}

fn ours(triangles: &[Triangle], emitter: EmitterKind, max_leaf_size: u32) -> f64 {
    let mut options = BuildOptions::default();
    (options.config.emitter, options.config.max_leaf_size) = (emitter, max_leaf_size);
    let run = run::build(triangles, &options).unwrap_or_else(|e| panic!("{e}"));
    run.check().unwrap_or_else(|e| panic!("{e}")).sah_cost().to_num()
}

#[test]
fn trees_are_as_good_as_those_of_a_ploc_builder_with_all_memory_at_hand() {
    let columns = [
        "sweep",
        "LBVH",
        "R8 leaf 1",
        "R16 leaf 1",
        "obvhs 6",
        "obvhs 14",
        "R8 leaf 4",
        "obvhs 6+c",
        "obvhs 14+c",
    ];
    println!("SAH cost (Ci 1.2, Cl 0, Ct 1), all measured by the same code;");
    println!(
        "leaf 1: one primitive a leaf, as obvhs' builder makes; +c: its leaves collapsed to 4"
    );
    print!("{:<14}", "");
    columns.iter().for_each(|name| print!(" {name:>10}"));
    println!();
    for name in ["bunny", "sponza_crytek", "sibenik", "dragon_res2", "terrain", "sphereflake"] {
        let Ok(mesh) = scene::load(name, &LoadOptions::default()) else {
            println!("skipped: {name}: not found; set XYLEM_SCENES to a folder of meshes");
            continue;
        };
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(Triangle::bounds).collect();
        let ploc = |radius| EmitterKind::Ploc(PlocConfig { radius, ..PlocConfig::DEFAULT });
        let peer = |distance, leaf| {
            let mut tree = obvhs_ploc(&boxes, distance);
            if leaf > 1 {
                collapse(&mut tree, leaf, 1.2);
            }
            let tree = host_tree(&tree, &boxes);
            let mut all = tree.primitives.clone();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..boxes.len() as u32), "{name}: a primitive is missing");
            tree.sah_cost().to_num::<f64>()
        };
        let costs = [
            sweep(&boxes, SweepLeaves::Sah).sah_cost().to_num(),
            ours(&mesh.triangles, EmitterKind::Lbvh, 255),
            ours(&mesh.triangles, ploc(8), 1),
            ours(&mesh.triangles, ploc(16), 1),
            peer(PlocSearchDistance::Low, 1),
            peer(PlocSearchDistance::Medium, 1),
            ours(&mesh.triangles, ploc(8), 4),
            peer(PlocSearchDistance::Low, 4),
            peer(PlocSearchDistance::Medium, 4),
        ];
        print!("{name:<14}");
        costs.iter().for_each(|cost| print!(" {cost:>10.2}"));
        println!();
        // One is of search distance 8, the other of 6 and 14.
        let [.., single, _, low, medium, leaves, low_c, medium_c] = costs;
        assert!(
            single < 1.03 * low.max(medium),
            "{name}: {single:.2} against {low:.2}, {medium:.2}"
        );
        assert!(
            leaves < 1.03 * low_c.max(medium_c),
            "{name}: {leaves:.2}, {low_c:.2}, {medium_c:.2}"
        );
    }
}
