//! Rules for rebuilding, measured against the best schedule that hindsight finds.

use std::fmt::Write as _;

use rayon::prelude::*;
use xylem::bus::MEMORIES;
use xylem::run::{self, BuildOptions, RefitMethod};
use xylem::scene::{self, Animation, LoadOptions, Mesh, Movement};
use xylem_core::compress::Compression;
use xylem_core::quality::SahCost;
use xylem_core::refit::{Factor, RebuildRule, Update, Upkeep};
use xylem_tests::{places, results};

/// SAH costs of every tree in every frame: `costs[i][k]` is that of the tree built in frame `i` and
/// refitted to frame `i + k`.
struct Costs(Vec<Vec<SahCost>>);

impl Costs {
    fn of(animation: &Animation) -> Self {
        let frames = &animation.frames;
        let method = RefitMethod::InPlace(Compression::DEFAULT);
        let from = |i: usize| {
            let options = BuildOptions::default();
            let built = run::build(&frames[i].triangles, &options);
            let mut run = built.unwrap_or_else(|e| panic!("{e}"));
            let mut costs = vec![run.check().unwrap_or_else(|e| panic!("{e}")).sah_cost()];
            costs.extend(frames[i + 1..].iter().map(|mesh| {
                let done = run::refit(&mut run, &mesh.triangles, &method, MEMORIES[0]);
                done.unwrap_or_else(|e| panic!("{e}")).cost
            }));
            costs
        };
        Self((0..frames.len()).into_par_iter().map(from).collect())
    }

    fn frames(&self) -> usize {
        self.0.len()
    }

    fn cost(&self, built: usize, frame: usize) -> f64 {
        self.0[built][frame - built].to_num()
    }

    /// The sum of all frames' costs if trees are built in the frames that `rebuild` says, and how many
    /// are; each after the first has a price.
    fn total(&self, price: f64, mut rebuild: impl FnMut(usize, usize) -> bool) -> (f64, usize) {
        let (mut built, mut sum, mut count) = (0, self.cost(0, 0), 0);
        for frame in 1..self.frames() {
            if rebuild(built, frame) {
                (built, count) = (frame, count + 1);
                sum += price;
            }
            sum += self.cost(built, frame);
        }
        (sum, count)
    }

    /// What a rule comes to.
    fn by_rule(&self, price: f64, rule: RebuildRule) -> (f64, usize) {
        let mut upkeep = Upkeep::new(rule);
        upkeep.after_rebuild(self.0[0][0]);
        self.total(price, |built, frame| {
            let update = upkeep.after_refit(self.0[built][frame - built]);
            if update == Update::Rebuild {
                upkeep.after_rebuild(self.0[frame][0]);
            }
            update == Update::Rebuild
        })
    }

    /// The lowest sum of all schedules.
    fn best(&self, price: f64) -> f64 {
        let n = self.frames();
        // From frame i on, with a tree built there; the price of the first is not counted.
        let mut from = vec![0.0; n + 1];
        for i in (0..n).rev() {
            let mut sum = 0.0;
            from[i] = f64::INFINITY;
            for end in i + 1..=n {
                sum += self.cost(i, end - 1);
                let rest = if end < n { price + from[end] } else { 0.0 };
                from[i] = from[i].min(sum + rest);
            }
        }
        from[0]
    }

    /// The mean cost of a fresh tree.
    fn fresh(&self) -> f64 {
        (0..self.frames()).map(|i| self.cost(i, i)).sum::<f64>() / self.frames() as f64
    }
}

fn twist(name: &str, mesh: &Mesh, frames: u32) -> (String, Costs) {
    let animation = Animation::new(mesh, &Movement::Twist, frames, &LoadOptions::default());
    (format!("{name}, twisted"), Costs::of(&animation.unwrap_or_else(|e| panic!("{e}"))))
}

/// Animations between key frames, where the meshes are at hand: name, keys, frames.
const KEYED: [(&str, &[u32], u32); 4] = [
    ("anim_elephant", &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 64),
    ("anim_armadillo_rollers", &[0, 1], 32),
    ("anim_brainstem", &[0, 2, 4, 6], 32),
    ("anim_rod_twist", &[0, 1], 32),
];

fn keyed(name: &str, keys: &[u32], frames: u32) -> Option<(String, Costs)> {
    let options = LoadOptions::default();
    let load = |key| scene::load(&format!("{name}_f{key}"), &options).ok();
    let mut meshes = keys.iter().map(load).collect::<Option<Vec<_>>>()?;
    let first = meshes.remove(0);
    let animation = Animation::new(&first, &Movement::Keys(meshes), frames, &options);
    Some((name.to_owned(), Costs::of(&animation.unwrap_or_else(|e| panic!("{e}")))))
}

/// What a rebuild costs more than a refit, in frames of tracing a fresh tree.
const PRICES: [f64; 3] = [0.1, 1.0, 10.0];

#[test]
fn rules_come_close_to_the_best_schedule() {
    let test = "rules_come_close_to_the_best_schedule";
    let mut subjects: Vec<_> = ["terrain:4", "sphereflake:1", "hair:hairs=40,segments=8"]
        .map(|name| twist(name, &places::procedural(name), 24))
        .into();
    if places::full() && places::folder("XYLEM_SCENES", test).is_some() {
        let (mut found, mut missing) = (Vec::new(), Vec::new());
        for (name, keys, frames) in KEYED {
            match keyed(name, keys, frames) {
                Some(subject) => found.push(subject),
                None => missing.push(name),
            }
        }
        subjects.extend(found);
        assert!(missing.len() < KEYED.len(), "XYLEM_SCENES holds none of {missing:?}");
        if !missing.is_empty() {
            println!("skipped: {test}: no {missing:?} in XYLEM_SCENES");
        }
    }

    let mut body = format!(
        "What frames cost together over the best schedule with hindsight, in per cent above it, and how \
         often the tree was rebuilt. A frame costs its tree's SAH cost; a rebuild, in addition, the price \
         in the second column in fresh trees' mean costs. `drift` rebuilds at a factor, `amortised` knows \
         the price. Recorded {}.\n\n\
         | animation | price | always | never | drift 1.1 | drift 1.3 | drift 2 | amortised |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|\n",
        results::today()
    );
    let drift = |factor: f64| RebuildRule::Drift(Factor::from_num(factor));
    let mut worst = 0f64;
    for (name, costs) in &subjects {
        for share in PRICES {
            let price = share * costs.fresh();
            let best = costs.best(price);
            let above = |(sum, _): (f64, usize)| 100.0 * (sum / best - 1.0);
            let text = |total: (f64, usize)| format!("{:.1} ({})", above(total), total.1);
            let amortised =
                costs.by_rule(price, RebuildRule::Amortised(Factor::saturating_from_num(price)));
            let others = [
                costs.total(price, |_, _| true),
                costs.total(price, |_, _| false),
                costs.by_rule(price, drift(1.1)),
                costs.by_rule(price, drift(1.3)),
                costs.by_rule(price, drift(2.0)),
            ];
            for total in others.into_iter().chain([amortised]) {
                assert!(above(total) > -1e-6, "{name}: better than the best");
            }
            let [always, never, low, default, high] = others.map(text);
            writeln!(
                body,
                "| {name} | {share} | {always} | {never} | {low} | {default} | {high} | {} |",
                text(amortised)
            )
            .unwrap();
            worst = worst.max(above(amortised));
        }
    }
    results::report("Refit or rebuild", &body);
    assert!(worst < 10.0, "amortised: {worst:.1} % above the best schedule");
}
