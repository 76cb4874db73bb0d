//! What a checkpoint belongs to.

use deepsft_train::Fingerprint;

#[test]
fn a_fingerprint_comes_back_from_a_file_and_names_what_differs() {
    let now = Fingerprint::default().with("network", &[1, 2]).with("samples", &"a");
    let saved: Fingerprint = serde_json::from_str(&serde_json::to_string(&now).unwrap()).unwrap();
    assert_eq!(now.difference(&saved), None);
    let other = Fingerprint::default().with("network", &[1, 2]).with("samples", &"b");
    assert_eq!(now.difference(&other), Some("samples".to_owned()));
    assert!(now.agrees_in(&other, "network") && !now.agrees_in(&other, "samples"));
}
