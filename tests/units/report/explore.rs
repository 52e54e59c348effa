use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::DeflateDecoder;
use gonio::brdf::measured::merl::MerlGrid;
use gonio::brdf::{Channels, Lambert, Spectrum};
use gonio::report::explore::{Exploration, ShownMaterial};
use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::io::Read;
use std::sync::Arc;

const HOSTILE: &str = "</script><script>alert(1)</script>\"'&";

fn page(name: &str, albedo: f64) -> String {
    let brdf = Lambert::new(Spectrum::Grey(albedo), Channels::Luminance);
    let page = Exploration {
        materials: vec![ShownMaterial::new(name, "lambert", Arc::new(brdf))],
        ..Exploration::default()
    };
    page.html().unwrap()
}

/// What is in the element of a name that begins so, the last of them.
fn inside<'a>(page: &'a str, name: &str, begins: &str) -> &'a str {
    let (_, rest) = page.rsplit_once(&format!("<{name}{begins}")).unwrap();
    rest.split_once(&format!("</{name}>")).unwrap().0
}

/// The numbers of a page but its tables.
fn data(page: &str) -> &str {
    inside(page, "script", " type=\"application/json\" id=\"data\">")
}

const TABLE: &str = " type=\"text/plain\" id=\"table-0\">";

#[test]
fn the_policy_allows_the_script_and_the_style_alone() {
    let page = page("plain", 0.5);
    for (tag, key) in [("script", "script-src"), ("style", "style-src")] {
        let hash = STANDARD.encode(Sha256::digest(inside(&page, tag, ">")));
        let expected = format!("{key} 'sha256-{hash}'");
        assert!(page.contains(&expected), "the hash of {tag} is {hash}");
    }
    assert!(page.contains("content=\"default-src 'none'; "));
    for foreign in ["http://", "https://", "src=", "@import", "<link", "url("] {
        // What an SVG calls itself and its own parts.
        let page = page.replace("http://www.w3.org/2000/svg", "");
        let page = page.replace("url(#", "");
        assert!(!page.contains(foreign), "{foreign}");
    }
}

#[test]
fn names_are_text_and_values_are_in_the_page() {
    let (text, plain) = (page(HOSTILE, 0.5), page("plain", 0.5));
    assert_eq!(
        text.matches("<script").count(),
        plain.matches("<script").count()
    );
    let data: Json = serde_json::from_str(data(&text)).unwrap();
    let material = &data["materials"][0];
    assert_eq!(material["name"], HOSTILE);
    let table = &material["table"];
    let bytes = STANDARD.decode(inside(&text, "script", TABLE)).unwrap();
    let mut words = Vec::new();
    let mut deflated = DeflateDecoder::new(&bytes[..]);
    deflated.read_to_end(&mut words).unwrap();
    let half = words.len() / 2;
    assert_eq!(half, 90 * 90 * 180);
    // Values of one size: the first code everywhere, or no data, and no difference from cell to cell.
    let codes = (0..half).map(|i| u16::from_le_bytes([words[i], words[half + i]]));
    let (known, lacking): (Vec<u16>, Vec<u16>) = codes.partition(|code| *code > 1);
    assert!(known.iter().all(|code| *code == 2) && lacking.iter().all(|code| *code == 0));
    let low = table["low"].as_f64().unwrap();
    assert!((low.exp() - 0.5 / std::f64::consts::PI).abs() < 1e-12);
    let cells = (0..half).map(|i| [i / 180 / 90, i / 180 % 90, i % 180]);
    let above = cells.filter(|cell| MerlGrid::RECIPROCAL.pair(*cell).is_some());
    assert_eq!(known.len(), above.count());
}

#[test]
fn black_materials_have_a_page() {
    let text = page("black", 0.0);
    let data: Json = serde_json::from_str(data(&text)).unwrap();
    let note = &data["materials"][0]["note"];
    assert_eq!(note, "all of its values are 0");
}
