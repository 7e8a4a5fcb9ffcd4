//! What `pleach evaluate` prints and writes.

/// Runs `pleach evaluate` with these arguments.
fn evaluate_command(arguments: &[&str]) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_pleach"))
        .arg("evaluate")
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn the_command_prints_the_report_and_writes_it_with_pictures() {
    let oak = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/oak.glb");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/folder");
    let level = format!("{oak}@32");
    let arguments = [
        oak,
        &level,
        "--json",
        "--client",
        "--height",
        "64",
        "--views",
        "4",
        "--elevations",
        "0,30,-15",
        "-o",
    ];
    let done = evaluate_command(&[&arguments[..], &[out.to_str().unwrap()]].concat());
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let report: pleach::report::schema::Report = serde_json::from_slice(&done.stdout).unwrap();
    let sizes = &report.levels[0].sizes;
    assert_eq!(
        sizes.iter().map(|s| s.height_px).collect::<Vec<_>>(),
        [64, 32, 16]
    );
    assert!(
        sizes
            .iter()
            .all(|s| s.f1.mean == 1.0 && s.client.is_some() && s.views.len() == 4)
    );
    let written = std::fs::read(out.join("report.json")).unwrap();
    assert_eq!(written, done.stdout);
    for picture in ["contact.png", "contact-client.png"] {
        let sheet = image::open(out.join(picture)).unwrap().to_rgb8();
        let tree = sheet.pixels().filter(|p| p.0 != [255; 3]).count();
        assert!(tree > 1000, "{picture}: {tree} pixels");
    }
}

#[test]
fn the_command_looks_through_the_lens_of_the_levels_scene_or_along_parallel_lines() {
    let oak = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/oak.glb");
    let folder = tempfile::tempdir().unwrap();
    // A level that states another screen, as `bake --scene` writes it.
    let level = folder.path().join("level.glb");
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,
        "extras":{"screen_height":0.05,"screen_height_px":1000,"fov_deg":90}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}]}"#;
    let json = format!("{json:<width$}", width = json.len().next_multiple_of(4));
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let length = |bytes: usize| (bytes as u32).to_le_bytes();
    let glb = [
        &b"glTF"[..],
        &length(2),
        &length(28 + json.len() + 36),
        &length(json.len()),
        b"JSON",
        json.as_bytes(),
        &length(36),
        b"BIN\0",
        &corners.map(f32::to_le_bytes).concat(),
    ]
    .concat();
    std::fs::write(&level, glb).unwrap();
    let run = |more: &[&str]| -> pleach::report::schema::Report {
        let fixed = [oak, level.to_str().unwrap(), "--json", "--silhouettes"];
        let sizes = ["--height", "32", "--views", "2", "--elevations", "0"];
        let done = evaluate_command(&[&fixed[..], &sizes, more].concat());
        let trouble = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.success(), "{trouble}");
        serde_json::from_slice(&done.stdout).unwrap()
    };
    // 1000 lines and 90 degrees: 1000 / (2 tan 45 degrees) = 500.
    let report = run(&[]);
    assert!((report.focal_px.unwrap() - 500.0).abs() < 1e-3);
    assert_eq!(report.levels[0].sizes[0].height_px, 50);
    assert_eq!(run(&["--orthographic"]).focal_px, None);
}

/// One file that asks for nothing else, with pictures for every level and each of them named.
#[test]
fn the_page_holds_everything_itself() {
    let oak = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/oak.glb");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let (near, far) = (format!("{oak}@48"), format!("{oak}@24"));
    let done = evaluate_command(&[
        oak,
        &near,
        &far,
        "--height",
        "32",
        "--views",
        "3",
        "--elevations",
        "0",
        "-o",
        out,
    ]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let text = String::from_utf8(done.stdout).unwrap();
    assert!(
        text.contains("FLIP") && text.contains("turned by 1 degree"),
        "{text}"
    );
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    for wanted in [
        "<html lang=\"en\">",
        "id=\"level-2\"",
        "Precision and recall",
        "prefers-color-scheme",
    ] {
        assert!(page.contains(wanted), "{wanted}");
    }
    for foreign in ["http:", "https:", "@import", "src=\"/"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    let pictures = page.matches("<img").count();
    assert_eq!(
        pictures,
        page.matches("src=\"data:image/png;base64,").count()
    );
    assert_eq!(pictures, page.matches(" alt=\"").count());
    // For each level: two pictures twice, two maps, and the images of its file.
    assert!(pictures >= 2 * 7, "{pictures}");
}

#[test]
fn the_command_refuses_what_it_cannot_read_or_measure() {
    let oak = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/oak.glb");
    for wrong in [
        &[oak][..],
        &[oak, "no-such-file.glb"],
        &[oak, oak, "--height", "0"],
        &[oak, oak, "--height", "64,-3"],
        &[oak, oak, "--views", "0"],
        &[oak, oak, "--elevations", "90"],
    ] {
        let done = evaluate_command(wrong);
        assert_eq!(done.status.code(), Some(2), "{wrong:?}");
        assert!(!done.stderr.is_empty());
    }
}

#[test]
fn ctrl_c_ends_a_long_evaluation_and_nothing_is_written() {
    let oak = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/oak.glb");
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["evaluate", oak, oak, "--views", "1000", "-o"])
        .arg(&out)
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // Loading takes a fraction of that, a thousand views many minutes.
    std::thread::sleep(std::time::Duration::from_secs(2));
    let stop = format!("kill -INT {}", child.id());
    let mut shell = std::process::Command::new("sh");
    assert!(shell.args(["-c", &stop]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!out.exists());
}
