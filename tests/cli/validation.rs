//! What readings say of their own reconstruction.

use super::Bench;
use super::common::says;
use super::tables::{f_r, sheets};

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";

fn bench() -> Bench {
    let bench = Bench::new();
    let rows = sheets(|i, o, a| format!("{i},0,{o},{},{}", (a + 180.0) % 360.0, f_r(i, o, a)));
    bench.write("sheets.csv", HEAD.to_owned() + &rows);
    bench
}

#[test]
fn readings_by_others_choose_their_method() {
    let bench = bench();
    let said = bench.good("reconstruct sheets.csv --verbose");
    let left =
        "left out: each in turn of 3 sheets of constant theta_i, with a third of the others\n";
    says(&said, left);
    // What stands first is what is taken, and errors rise from row to row.
    let from = said.find("nrmse, cosine\n").unwrap();
    let ranking = said[from..].lines().skip(1);
    let ranking: Vec<_> = ranking
        .take_while(|l| !l.starts_with("errors of"))
        .collect();
    assert!(ranking.len() > 20, "{said}");
    let best = ranking[0].split_whitespace().next().unwrap();
    says(&said, &format!("reconstruction: {best}\n"));
    let errors = ranking.iter().map(|l| l.split_whitespace().nth(1).unwrap());
    let errors: Vec<f64> = errors.map(|e| e.parse().unwrap()).collect();
    assert!(errors.is_sorted(), "{errors:?}");
    // One that is named is not ranked, but judged.
    let named = bench.good("reconstruct sheets.csv --reconstruction nearest");
    says(&named, "errors of nearest at readings left out:\n");
    assert!(!named.contains("nrmse, cosine"), "{named}");
    let points = "--cross-validation points";
    bench.tells(
        format!("reconstruct sheets.csv {points}"),
        "left out: each in turn of 10 random sets\n",
    );
    let none = bench.good("reconstruct sheets.csv --cross-validation none");
    assert!(!none.contains("left out"), "{none}");
    says(&none, "reconstruction: kriging\n");
}

#[test]
fn readings_judge_those_of_another_file() {
    let bench = bench();
    let others = [
        [25.0, 33.0, 10.0],
        [50.0, 41.0, 200.0],
        [33.0, 60.0, 100.0],
        [10.0, 5.0, 45.0],
    ];
    let row = |[i, o, a]: [f64; 3]| format!("{i},0,{o},{},{}\n", (a + 180.0) % 360.0, f_r(i, o, a));
    let text: String = others.into_iter().map(row).collect();
    bench.write("others.csv", HEAD.to_owned() + &text);
    let how = "--cross-validation none --against others.csv";
    let said = bench.good(format!("reconstruct sheets.csv {how}"));
    says(&said, "against others.csv: 4 poses");
    let line = said
        .lines()
        .rfind(|l| l.starts_with("log_relative "))
        .unwrap();
    let error: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(error > 0.0 && error < 0.2, "{said}");
}

#[test]
fn what_cannot_be_validated_is_said() {
    let bench = bench();
    let one = "30,0,20,180,0.2\n";
    bench.write("one.csv", HEAD.to_owned() + one);
    let said = bench.good("reconstruct one.csv");
    let told = "no cross-validation: 1 reading; allowed: 2 or more at different places";
    says(&said, told);
    let sheets = "--cross-validation sheets";
    bench.refuses(
        format!("reconstruct one.csv {sheets}"),
        2,
        "--cross-validation: ",
    );
    // What was read at one incidence or two, or in one plane, says nothing of the rest.
    let rows = bench.read("sheets.csv");
    let some = |file: &str, keep: &dyn Fn(&str) -> bool| {
        let kept = rows
            .lines()
            .filter(|row| row.starts_with("theta") || keep(row));
        bench.write(file, kept.collect::<Vec<_>>().join("\n"));
        bench.good(format!("reconstruct {file}"))
    };
    let said = some("sheet.csv", &|row| row.starts_with("40,"));
    says(&said, "the readings are of 1 value of theta_i, and");
    let said = some("two.csv", &|row| !row.starts_with("40,"));
    says(&said, "the readings are of 2 values of theta_i, and");
    let said = some("scans.csv", &|row| {
        row.split(',')
            .nth(3)
            .is_some_and(|a| a == "0" || a == "180")
    });
    says(&said, "the readings are in the plane of incidence, and");
    let stark = "--parametrization stark";
    let said = bench.good(format!("reconstruct sheets.csv {stark}"));
    let best = said
        .lines()
        .rfind(|l| l.starts_with("reconstruction: "))
        .unwrap();
    assert!(best.contains("[stark"), "{said}");
    let none = "--reconstruction auto --cross-validation none";
    bench.refuses(
        format!("reconstruct sheets.csv {none}"),
        2,
        "auto chooses by what is left out",
    );
    bench.refuses(
        "reconstruct sheets.csv --set neighbours=12",
        2,
        "--reconstruction KIND",
    );
    bench.refuses(
        "reconstruct sheets.csv --reconstruction autos",
        2,
        "did you mean auto?",
    );
}
