//! `flockreel check-plan LIBRARY_DIR FLOCK_JSON`: checks that a stored plan is valid and optimal
//! (docs/explanation/algorithms.md, "Planning"). Exit status 0 if it is, else 2 with the first violation.

use std::path::PathBuf;

use serde_json::json;

use super::{Error, Listener, Summary};
use crate::flock::check::check;
use crate::formats::flock_json;

/// Arguments of `check-plan`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    /// Plan of the flock, written by `flock --plan`.
    #[arg(value_name = "FLOCK_JSON")]
    plan: PathBuf,
}

/// Checks the plan.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let library = super::read_library(&args.library, &args.plan)?.library;
    let bytes = std::fs::read(&args.plan)
        .map_err(|cause| Error::Usage(format!("cannot read {}: {cause}", args.plan.display())))?;
    let flock = flock_json::read(&bytes).map_err(|cause| {
        Error::Usage(format!(
            "not a flock.json: {}: {cause}",
            args.plan.display()
        ))
    })?;
    let n_jumps = check(&library, &flock, &Listener::new())
        .map_err(|violation| Error::Usage(violation.to_string()))?;
    let n_individuals = flock.individuals.len();
    let n_frames = n_individuals * flock.params.frames as usize;
    super::say(&format!(
        "the plan is valid: {n_individuals} individuals, {n_frames} frames, {n_jumps} jumps; no individual has a \
         cheaper plan"
    ));
    Ok(Some(Summary(json!({
        "plan": args.plan,
        "individuals": n_individuals,
        "frames": n_frames,
        "jumps": n_jumps,
    }))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::formats::library_dir;
    use crate::formats::library_json::FootageSummary;
    use crate::library::View;
    use crate::progress::Silent;

    #[test]
    fn a_stored_plan_holds_and_one_changed_by_hand_exits_with_2_and_a_sentence() {
        let library = synthetic::library(View::Side);
        let params = Params {
            count: Some(2),
            frames: 50,
            ..Params::default()
        };
        let dir = tempfile::tempdir().unwrap();
        let footage = FootageSummary {
            sha256: "ab".into(),
            n_bytes: 9,
        };
        let analysis = analysis::Params::default();
        library_dir::write(dir.path(), &library, &analysis, &footage).unwrap();
        // The plan is made from the stored library, which the command reads too.
        let library = crate::cli::read_library(dir.path(), dir.path())
            .unwrap()
            .library;
        let flock = plan_flock(&library, &params, &Silent).unwrap();
        let plan = dir.path().join("flock.json");
        let outcome = |bytes: &[u8]| {
            std::fs::write(&plan, bytes).unwrap();
            run(Args {
                library: dir.path().to_owned(),
                plan: plan.clone(),
            })
        };
        let bytes = flock_json::write(&flock);
        let Summary(summary) = outcome(&bytes).unwrap().unwrap();
        assert_eq!(
            (&summary["individuals"], &summary["frames"]),
            (&json!(2), &json!(100))
        );

        let text = String::from_utf8(bytes).unwrap();
        let total = format!("\"total\":{}", flock.individuals[1].cost.total);
        let changed = text.replace(&total, "\"total\":0.0");
        let error = outcome(changed.as_bytes()).expect_err("not what it costs");
        assert_eq!(error.exit_code(), 2);
        let sentence = error.to_string();
        assert!(
            sentence.starts_with("individual 1: cost.total or its parts are not "),
            "{sentence}"
        );
        assert!(sentence.ends_with("(wrong_cost)"), "{sentence}");

        let error = outcome(b"{}").expect_err("no flock");
        assert!(error.to_string().starts_with("not a flock.json: "));
    }
}
