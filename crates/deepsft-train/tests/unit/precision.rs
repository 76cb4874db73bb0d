//! Precisions by name.

use deepsft_train::Precision;

#[test]
fn precisions_are_named_as_people_type_them() {
    for name in ["f32", "f16", "bf16"] {
        assert_eq!(name.parse::<Precision>().unwrap().to_string(), name);
    }
    assert!("f64".parse::<Precision>().unwrap_err().to_string().contains("bf16"));
}
