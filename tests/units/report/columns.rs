use gonio::report::Columns;

#[test]
fn columns_are_as_wide_as_their_cells() {
    let mut columns = Columns::new("name\t>reach °\t");
    columns.row("gonio – one\t7.5\twraps");
    columns.row("  b\t–");
    let lines: Vec<_> = columns.to_string().lines().map(String::from).collect();
    assert_eq!(
        lines,
        [
            "name         reach °",
            "gonio – one      7.5  wraps",
            "  b                –",
        ]
    );
}
