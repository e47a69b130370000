//! Every program the renderer can ask for is valid, and no file is left out of them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;

use heightfield::Technique;

/// Entries with the surfaces they are composed with; `true`: and with every search.
const ENTRIES: &[(&str, &[&str], bool)] = &[
    ("plain", &["flat", "bump_derivative"], false),
    ("sloped", &["bump", "bump_forward", "bump_orthogonal", "bump_blinn", "normal"], false),
    ("bent", &["bump_exact"], false),
    ("mapped", &["tangent"], false),
    ("dot3", &["dot3"], false),
    ("relief", &["displaced"], true),
    ("relief_mapped", &["tangent"], true),
    ("kernels/march", &[], true),
];

fn programs() -> Vec<(String, String)> {
    let mut programs = Vec::new();
    for (entry, surfaces, searched) in ENTRIES {
        let searches: Vec<Option<&str>> = if *searched {
            Technique::all().iter().map(|info| Some(info.name)).collect()
        } else {
            vec![None]
        };
        let surfaces: Vec<Option<&str>> =
            if surfaces.is_empty() { vec![None] } else { surfaces.iter().copied().map(Some).collect() };
        for search in &searches {
            for surface in &surfaces {
                let name = format!("{entry} + {search:?} + {surface:?}");
                programs.push((name.clone(), shaders::compose(entry, *search, *surface).unwrap()));
                if !["plain", "dot3", "kernels/march"].contains(entry) {
                    let program = shaders::compose_with_horizon(entry, *search, *surface).unwrap();
                    programs.push((name + " + horizon", program));
                }
            }
        }
    }
    for entry in ["displaced", "shell"] {
        for surface in ["displaced", "tangent"] {
            let program = shaders::compose(entry, Some("exact"), Some(surface)).unwrap();
            programs.push((format!("{entry} + {surface}"), program));
        }
    }
    programs
}

#[test]
fn every_program_is_valid() {
    for (name, source) in programs() {
        if let Err(error) = shaders::validate(&source) {
            panic!("{name}: {error}");
        }
    }
}

#[test]
fn every_file_belongs_to_a_program() {
    let mut used = BTreeSet::new();
    for (_, source) in programs() {
        used.extend(source.lines().filter_map(|line| line.strip_prefix("// ---- ")).map(str::to_owned));
    }
    let known: BTreeSet<String> = shaders::files().map(str::to_owned).collect();
    assert_eq!(known.difference(&used).collect::<Vec<_>>(), Vec::<&String>::new(), "unused files");
}

#[test]
fn searches_and_techniques_are_the_same() {
    let files: BTreeSet<&str> = shaders::files()
        .filter_map(|path| path.strip_prefix("search/").and_then(|name| name.strip_suffix(".wgsl")))
        .collect();
    let names: BTreeSet<&str> = Technique::all().iter().map(|info| info.name).collect();
    assert_eq!(files, names);
}

#[test]
fn parameters_are_override_constants_with_the_same_defaults() {
    for info in Technique::all() {
        let module =
            shaders::validate(&shaders::compose("kernels/march", Some(info.name), None).unwrap()).unwrap();
        let text = shaders::read(&format!("search/{}.wgsl", info.name)).unwrap();
        for parameter in info.parameters {
            assert!(
                module.overrides.iter().any(|(_, o)| o.name.as_deref() == Some(parameter.name)),
                "search/{}.wgsl has no override {}",
                info.name,
                parameter.name
            );
            let line = format!("override {}: i32 = {};", parameter.name, parameter.default);
            assert!(text.contains(&line), "search/{}.wgsl lacks {line:?}", info.name);
        }
        let own = text.matches("override ").count();
        assert_eq!(own, info.parameters.len(), "search/{}.wgsl has other overrides", info.name);
    }
}

#[test]
fn folders_hold_what_they_should() {
    for path in shaders::files() {
        let text = shaders::read(path).unwrap();
        let lines = text.lines().count();
        assert!(lines <= 250, "{path} has {lines} lines");
        assert!(text.starts_with("//"), "{path} does not say what it is for");
        let folder = path.split('/').next().unwrap();
        let binds = text.contains("@group(");
        let enters = ["@vertex", "@fragment", "@compute"].iter().any(|stage| text.contains(stage));
        assert_eq!(enters, matches!(folder, "entry" | "kernels"), "{path}: entry points");
        assert!(!binds || matches!(folder, "bindings" | "kernels"), "{path}: bindings");
        // Outside entries a function may run inside a loop or branch, where these are undefined.
        let implicit = ["textureSample(", "dpdx(", "dpdy(", "fwidth("].iter().any(|call| text.contains(call));
        assert!(!implicit || folder == "entry", "{path}: implicit derivatives");
    }
}

#[test]
fn a_broken_program_is_refused() {
    assert!(shaders::validate("fn f() -> f32 { return 1u; }").is_err());
}
