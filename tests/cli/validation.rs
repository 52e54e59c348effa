//! What readings say of their own reconstruction.

use super::common::says;
use super::tables::{f_r, readings};
use super::{Bench, READINGS, words_after};

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("sheets.csv", readings(1.0));
    bench
}

#[test]
fn readings_by_others_choose_their_method() {
    let bench = bench();
    let left = "cross-validation, each in turn of 3 sheets of constant theta_i, with a third of the others\n";
    let said = bench.tells("reconstruct sheets.csv --verbose", left);
    // What stands first is what is taken, and errors rise from row to row.
    let from = said.find("nrmse, cosine\n").unwrap();
    let ranking = said[from..].lines().skip(1);
    let is_row = |l: &&str| !l.starts_with("errors of");
    let ranking: Vec<_> = ranking.take_while(is_row).collect();
    assert!(ranking.len() > 20, "{said}");
    let best = ranking[0].split_whitespace().next().unwrap();
    says(&said, &format!("reconstruction: {best}\n"));
    let errors = ranking.iter().map(|l| l.split_whitespace().nth(1).unwrap());
    let errors: Vec<f64> = errors.map(|e| e.parse().unwrap()).collect();
    assert!(errors.is_sorted(), "{errors:?}");
    // One that is named is not ranked, but judged.
    let judged = "errors of nearest at readings left out:\n";
    let named = bench.tells("reconstruct sheets.csv --reconstruction nearest", judged);
    assert!(!named.contains("nrmse, cosine"), "{named}");
    let points = "10-fold cross-validation, random sets\n";
    bench.tells("reconstruct sheets.csv --cross-validation points", points);
    let kriging = "reconstruction: kriging\n";
    let none = bench.tells("reconstruct sheets.csv --cross-validation none", kriging);
    assert!(!none.contains("left out"), "{none}");
}

#[test]
fn readings_judge_those_of_another_file() {
    let bench = bench();
    let steep = [[33.0, 60.0, 100.0], [10.0, 5.0, 45.0]];
    let others = [[25.0, 33.0, 10.0], [50.0, 41.0, 200.0]]
        .into_iter()
        .chain(steep);
    let row = |[i, o, a]: [f64; 3]| format!("{i},0,{o},{},{}\n", (a + 180.0) % 360.0, f_r(i, o, a));
    let text: String = others.map(row).collect();
    bench.write("others.csv", READINGS.to_owned() + &text);
    let how = "--cross-validation none --against others.csv";
    let reconstruct = format!("reconstruct sheets.csv {how}");
    let said = bench.tells(reconstruct, "against others.csv: 4 poses");
    let error: f64 = words_after(&said, "log_relative ")[0].parse().unwrap();
    assert!(error > 0.0 && error < 0.2, "{said}");
}

#[test]
fn what_cannot_be_validated_is_said() {
    let bench = bench();
    bench.write("one.csv", READINGS.to_owned() + "30,0,20,180,0.2\n");
    bench.does(
        "0 | reconstruct one.csv | no cross-validation: 1 reading; allowed: 2 or more at different places
         2 | reconstruct one.csv --cross-validation sheets | --cross-validation:
         2 | reconstruct sheets.csv --reconstruction auto --cross-validation none | auto chooses by what is left out
         2 | reconstruct sheets.csv --set neighbours=12 | --reconstruction KIND
         2 | reconstruct sheets.csv --reconstruction autos | did you mean auto?",
    );
    // What was read at one incidence or two, or in one plane, says nothing of the rest.
    let rows = bench.read("sheets.csv");
    let some = |keep: &dyn Fn(&Vec<&str>) -> bool, told: &str| {
        let is_kept = |row: &&str| row.starts_with("theta") || keep(&row.split(',').collect());
        let kept: Vec<_> = rows.lines().filter(is_kept).collect();
        bench.write("some.csv", kept.join("\n"));
        let told = format!("the readings are {told}, and");
        bench.tells("reconstruct some.csv", &told);
    };
    some(&|row| row[0] == "40", "of 1 value of theta_i");
    some(&|row| row[0] != "40", "of 2 values of theta_i");
    let is_in_plane = |row: &Vec<&str>| ["0", "180"].contains(&row[3]);
    some(&is_in_plane, "in the plane of incidence");
    let said = bench.good("reconstruct sheets.csv --parametrization stark");
    let best = words_after(&said, "reconstruction: ").concat();
    assert!(best.contains("[stark"), "{said}");
}
