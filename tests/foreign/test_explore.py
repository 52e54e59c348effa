"""Pages of `gonio explore` in a browser: what they show is what the program has, they ask for nothing, and answer a hand in time."""

import csv, json, math, os, pathlib, shutil, statistics, struct, subprocess, time, xml.dom.minidom

import pytest
from browser import Browser
from conftest import lack, needs, optional

np, g = optional("numpy"), optional("gonio")
pytestmark = needs("numpy", "gonio")

PAGE = pathlib.Path(__file__).parents[2] / "src/report/explore/page"
MODULES = pathlib.Path(__file__).parents[2] / "target/foreign/node_modules"
VIEWS = ["directions", "slices", "coordinates", "machine", "appearance", "moments"]


@pytest.fixture(scope="session")
def browser():
    try:
        opened = Browser()
    except FileNotFoundError as error:
        if os.environ.get("GONIO_NO_BROWSER") == "1":
            pytest.skip(f"{error} (GONIO_NO_BROWSER=1)")
        lack(str(error))
    with opened:
        yield opened


@pytest.fixture(scope="session")
def pages(tmp_path_factory, gonio):
    """A folder of pages: of two tables with readings, of readings of a tour, and a blank one."""
    folder = tmp_path_factory.mktemp("pages")
    at = lambda name: folder / name
    for name, keys in ("a", ["alpha=0.3"]), ("b", ["alpha=0.2", "fresnel={kind=\"conductor\",eta=0.2,kappa=3.0}"]):
        gonio("tabulate", "ggx", *(word for key in keys for word in ("--set", key)), "-o", at(f"{name}.binary"))
    a = g.Material.open(str(at("a.binary")))
    plan = g.plan("sobol", 5000, "half-difference")
    g.measure(a, plan).write(str(at("readings.csv")))
    rows = at("readings.csv").read_text().splitlines()
    few = [row for row in rows if row.startswith("#") or row.startswith("index")] + [row for row in rows if row[:1].isdigit()][::16]
    at("few.csv").write_text("\n".join(row for row in few if not row.startswith("#")) + "\n")
    explore = lambda *words: gonio("explore", *words, "--force")
    explore(at("a.binary"), at("b.binary"), "--readings", at("readings.csv"), "-o", at("two.html"))
    explore(at("a.binary"), "--readings", at("few.csv"), "-o", at("few.html"))
    explore(at("a.binary"), "--plan", "configs/quickstart.toml", "--instrument", "sphere-camera", "-o", at("tour.html"))
    explore("-o", at("blank.html"))
    return folder


def opened(browser, path, fragment=""):
    """Opens a page, and returns how long it took until everything was shown."""
    browser.open(path.as_uri() + fragment)
    browser.wait("document.documentElement.dataset.open == 'yes'")
    return browser.evaluate("performance.now()") / 1000


def said(browser, view):
    return browser.evaluate(f"document.getElementById('{view}-said').textContent")


def rows(browser, view):
    return browser.evaluate(f"gonio.views.{view}.rows()")


def settle(browser):
    browser.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 250))))")


def directions(theta, phi):
    return g.direction(np.radians(theta), np.radians(phi))


def near(shown, true, digits=3):
    """True where numbers agree to so many digits."""
    shown, true = np.asarray(shown, float), np.asarray(true, float)
    assert np.allclose(shown, true, rtol=0.5 * 10.0**-digits, atol=1e-12), np.max(np.abs(shown / true - 1))


def test_types_of_the_script():
    """The checker of TypeScript finds nothing in the script, whose types stand in its comments."""
    tsc = MODULES / ".bin/tsc"
    if not tsc.exists():
        lack("no TypeScript in target/foreign")
    done = subprocess.run([tsc, "-p", PAGE], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_pages_are_small_ask_for_nothing_and_open_in_a_second(browser, pages):
    browser.size(1300, 900)
    for name, most in ("two", 4e6), ("few", 3e6), ("tour", 3e6), ("blank", 2e5):
        path = pages / f"{name}.html"
        assert path.stat().st_size <= most, (name, path.stat().st_size)
        # Other work on the machine only adds to it.
        seconds = min(opened(browser, path) for _ in range(3))
        settle(browser)
        assert browser.errors == [] and browser.requests == [], (name, browser.errors, browser.requests)
        shifts = browser.evaluate("""new Promise(done => new PerformanceObserver(list =>
            done(list.getEntries().reduce((sum, e) => sum + e.value, 0))).observe({type: "layout-shift", buffered: true}) || setTimeout(done, 300, 0))""")
        print(f"{name}: {path.stat().st_size} bytes, {seconds:.2f} s, shifts {shifts:.3f}")
        assert shifts < 0.05, name
        assert seconds <= 1.0, name


@pytest.mark.parametrize("light,plane", [((30, 0), 0), ((65, 20), 90), ((0, 0), 45)])
def test_values_are_those_of_the_tables(browser, pages, light, plane):
    opened(browser, pages / "two.html", f"#light={light[0]},{light[1]}&plane={plane}")
    tables = [g.Material.open(str(pages / f"{name}.binary"), channels="rgb") for name in "ab"]
    luminance = [0.2126, 0.7152, 0.0722]
    table = rows(browser, "slices")[1:]
    elevation = np.array([row[2] for row in table])
    sensor = directions(np.abs(elevation), light[1] + plane + np.where(elevation < 0, 180, 0))
    sun = np.broadcast_to(directions(*light), sensor.shape)
    for i, material in enumerate(tables):
        near([row[3 + i] for row in table], material.eval(sun, sensor) @ luminance)
    table = rows(browser, "directions")[1:]
    sensor = directions(np.array([row[2] for row in table]), np.array([row[3] for row in table]))
    near([row[4] for row in table], tables[0].eval(np.broadcast_to(directions(*light), sensor.shape), sensor) @ luminance)
    assert f"light {light[0]:.1f}°" in said(browser, "directions")


def test_coordinates_are_those_of_the_program(browser, pages):
    opened(browser, pages / "two.html")
    rng = np.random.default_rng(7)
    theta, phi = np.degrees(np.arccos(rng.random((2, 40)))) * 0.98, 360 * rng.random((2, 40))
    both = [directions(t, p) for t, p in zip(theta, phi)]
    pairs = json.dumps([[list(i), list(o)] for i, o in zip(*both)])
    for kind in g.parametrizations():
        browser.evaluate(f"gonio.set({{chart: '{kind}'}})")
        settle(browser)
        true = g.Parametrization(kind, symmetry="isotropic,reciprocal,bilateral".split(",")).forward(*both)
        axes = browser.evaluate("gonio.views.coordinates.chart().axes.map(a => [a.low, a.high])")
        places = browser.evaluate(f"{pairs}.map(pair => gonio.views.coordinates.places(pair))")
        for axis, (low, high) in enumerate(axes):
            assert np.allclose([low + p[axis] * (high - low) for p in places], true[:, axis], atol=2e-7), (kind, axis)
        # And back: the pair of coordinates has these coordinates.
        back = browser.evaluate(f"""{json.dumps([list(map(float, p)) for p in places])}.map(p => {{
            const pair = gonio.views.coordinates.pair(...p); return pair ? gonio.views.coordinates.places(pair) : p }})""")
        assert np.allclose(back, places, atol=1e-6), kind


def test_errors_moments_and_distortion_are_those_of_commands(browser, pages, gonio):
    opened(browser, pages / "two.html", "#view=45&moment=mean_10")
    shown = browser.evaluate("gonio.data.errors")
    tables = [g.Material.open(str(pages / f"{name}.binary")) for name in "ab"]
    true = g.compare(*tables, tolerance=0.04, max_pairs=16384)
    for row in shown:
        near(row["nrmse"], true[row["measure"]]["nrmse"])
    # Of the pictures under the sky by their pixels; the program weighs those of the rim by what the sphere covers of them.
    image, nrmse = browser.evaluate("""(() => {
        const y = ([r, g, b], i) => 0.2126 * r[i] + 0.7152 * g[i] + 0.0722 * b[i], [a, b] = gonio.views.appearance.skies;
        let [off, all] = [0, 0];
        a[0].forEach((_, i) => { const [f, g] = [y(a, i), y(b, i)]; if (f + g === f + g) { off += (g - f) ** 2; all += f * f } });
        return [Math.sqrt(off / all), gonio.data.sky[1].nrmse] })()""")
    assert math.isclose(image, nrmse, rel_tol=0.02)
    text = gonio("moments", pages / "a.binary")
    at = [row for row in csv.DictReader(text.splitlines()) if abs(float(row["theta_o_deg"]) - 45) < 0.01]
    moments = browser.evaluate("(({columns}, place) => columns.map(c => [c, gonio.views.moments.at(place, c)]))(gonio.data.moments[0], 0)")
    for name, value in moments:
        assert math.isclose(value, float(at[0][name]), rel_tol=2e-3, abs_tol=1e-5), name
    shares = json.loads(gonio("distortion", pages / "a.binary", "--table", "shares", "--format", "json"))
    of = {row["parametrization"]: row for row in shares if row.get("phi_deg") is None}
    for row in browser.evaluate("gonio.data.distortion.filter(d => d.material == 'a')"):
        assert any(np.allclose(v, row["shares"][0], atol=1e-9) for v in of[row["chart"]].values() if isinstance(v, float)), row


def test_every_control_moves_every_view_is_drawn_in_light_dark_and_narrow(browser, pages, tmp_path):
    folder = pathlib.Path(os.environ.get("GONIO_SHOTS", tmp_path))
    wide, dark, narrow = ("light", 1300), ("dark", 1300), ("light", 420)
    for name, looks in ("two", [wide, dark, narrow]), ("few", [dark]), ("tour", [wide, narrow]), ("blank", [narrow]):
        for scheme, width in looks:
            browser.size(width, 900)
            browser.scheme(scheme)
            opened(browser, pages / f"{name}.html")
            settle(browser)
            assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth"), (name, width)
            drawn = [v for v in VIEWS if browser.evaluate(f"!!gonio.views.{v} && !gonio.views.{v}.root.hidden")]
            assert ("machine" in drawn) == (name == "tour")
            for view in drawn:
                browser.screenshot(folder / f"{name}-{view}-{scheme}-{width}.png", f"#{view}")
                assert name == "blank" or said(browser, view)
            assert browser.errors == [], browser.errors
    browser.scheme("light")
    browser.size(1300, 2200)
    opened(browser, pages / "two.html")
    picture = lambda: browser.evaluate("Object.values(gonio.views).map(v => v.canvas.toDataURL()).join()")
    ids = browser.evaluate("[...document.querySelectorAll('select,input[type=range]')].filter(e => e.id && e.offsetParent).map(e => e.id)")
    assert len(ids) >= 14
    for name in ids:
        before = picture()
        browser.evaluate(f"""(e => {{
            if (e.tagName == 'SELECT') e.selectedIndex = (e.selectedIndex + 1) % e.length;
            else e.value = Number(e.value) + 0.4 * (Number(e.max) - Number(e.min)) * (Number(e.value) > 0.5 * Number(e.max) ? -1 : 1);
            e.dispatchEvent(new Event(e.tagName == 'SELECT' ? 'change' : 'input')) }})(document.getElementById('{name}'))""")
        settle(browser)
        assert picture() != before, name
    assert browser.errors == []
    for view in ("directions", "slices", "coordinates", "appearance", "moments"):
        xml.dom.minidom.parseString(browser.evaluate(f"gonio.views.{view}.svg()"))
        assert len(rows(browser, view)) > 10 and browser.evaluate(f"gonio.views.{view}.commandLine()").startswith("gonio ")


def test_a_drag_is_answered_in_time(browser, pages):
    browser.size(1300, 900)
    opened(browser, pages / "two.html", "#near=15")
    settle(browser)
    for view in "directions", "appearance":
        box = browser.evaluate(f"(e => {{ e.scrollIntoView(); const b = e.getBoundingClientRect(); return [b.x, b.y, b.width] }})(gonio.views.{view}.canvas)")
        settle(browser)
        x, y, w = box
        light = browser.evaluate("gonio.views.directions.place(gonio.state.light)") if view == "directions" else [w * 0.35, w * 0.3]
        browser.evaluate("void gonio.frames.splice(0)")
        points = [(x + light[0] + 60 * math.sin(k / 9), y + light[1] + 40 * math.sin(k / 7)) for k in range(200)]
        browser.drag([(x + light[0], y + light[1]), *points])
        frames = browser.evaluate("gonio.frames")
        median = statistics.median(frames)
        print(f"{view}: {len(frames)} frames, median {median:.1f} ms")
        assert len(frames) >= 100 and median <= 33, view
        before = browser.evaluate("String(gonio.state.light) + gonio.state.lamp")
        browser.touch([(x + light[0], y + light[1]), (x + light[0] + 20, y + light[1] + 30), (x + light[0] + 40, y + light[1] + 30)])
        settle(browser)
        assert browser.evaluate("String(gonio.state.light) + gonio.state.lamp") != before, view


def test_keys_and_fragments(browser, pages):
    opened(browser, pages / "two.html", "#light=40,10&scale=linear&show=difference&nonsense=1&near=x")
    assert browser.evaluate("[gonio.state.light, gonio.state.scale, gonio.state.near]") == [[40, 10], "linear", 2]
    browser.evaluate("gonio.views.directions.canvas.focus()")
    for key in "ArrowUp", "ArrowUp", "ArrowLeft":
        browser.key(key)
    settle(browser)
    assert browser.evaluate("gonio.state.light") == [42, 9]
    time.sleep(0.4)
    assert "light=42%2C9" in browser.evaluate("location.hash")


def test_readings_say_what_they_are_and_a_basket_becomes_a_schedule(browser, pages, gonio, tmp_path):
    browser.size(1300, 900)
    opened(browser, pages / "few.html", "#near=15&light=30,0")
    settle(browser)
    text = (pages / "few.csv").read_text().splitlines()
    reading = browser.evaluate("gonio.readings[3]")
    line = dict(zip(text[0].split(","), text[int(reading["line"]) - 1].split(",")))
    near(reading["value"], sum(w * float(line[f"value_{c}"]) for w, c in zip([0.2126, 0.7152, 0.0722], "rgb")))
    words = browser.evaluate("gonio.views.directions.ofReading(gonio.readings[3])")
    assert f"line {int(reading['line'])} of few.csv" in words and "let expect" in words
    # Of a material without noise readings are what the others let expect.
    off = browser.evaluate("gonio.readings.map(r => Math.abs(Math.log(r.expected / r.value)))")
    assert statistics.median(off) < 0.02
    browser.evaluate("void (gonio.views.directions.pointed = gonio.readings[3], gonio.views.directions.show())")
    for label in "Read again", "Add this pose":
        browser.evaluate(f"[...document.querySelectorAll('#directions button')].find(b => b.textContent == '{label}').click()")
    settle(browser)
    schedule = tmp_path / "poses.csv"
    schedule.write_text(browser.evaluate("gonio.schedule()"))
    gonio("measure", schedule, "--config", "configs/quickstart.toml", "--material", "ggx-0.3", "-o", tmp_path / "again.csv")
    assert len([row for row in (tmp_path / "again.csv").read_text().splitlines() if row[:1].isdigit()]) == 2


def test_the_tour_is_the_itinerary(browser, pages, gonio):
    opened(browser, pages / "tour.html")
    summary = browser.evaluate("({n: gonio.views.machine.count(), seconds: gonio.views.machine.total(), lost: gonio.data.machine.lostCount})")
    folder = pages / "schedules"
    found = json.loads(gonio("schedule", "configs/quickstart.toml", "--instrument", "sphere-camera", "--budget", "4000", "--material", "ggx-0.3",
                             "--skip-unreachable", "--json", "-o", f"{folder}/"))
    minutes = [row["visits"]["minutes"] for row in found]
    assert any(abs(summary["seconds"] / 60 - m) < 0.01 for m in minutes), (summary, minutes)
    # Arms, lamp and sample of the page measure the pair: seen from the sample.
    worst = browser.evaluate("""(() => { const m = gonio.views.machine, axes = gonio.data.machine.ends; let worst = 0;
        for (let i = 0; i < m.count(); i += 37) {
            const q = gonio.data.machine.axes.map((_, k) => m.cell(i, 9 + k));
            const [l, s, n] = [[axes.light], [axes.sensor], [axes.sample]].map(([a]) => m.inLab([0, 0, 1], a, q));
            const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            worst = Math.max(worst, Math.abs(dot(l, n) - m.cell(i, 5)), Math.abs(dot(s, n) - m.cell(i, 8)), 
                Math.abs(dot(l, s) - [0, 1, 2].reduce((t, c) => t + m.cell(i, 3 + c) * m.cell(i, 6 + c), 0)));
        } return worst })()""")
    assert worst < 2e-3
    taken = lambda: browser.evaluate("gonio.taken()")
    browser.evaluate("gonio.views.machine.go(0.5 * gonio.views.machine.total())")
    settle(browser)
    half = taken()
    assert 0.2 * summary["n"] < half < 0.8 * summary["n"]
    # One picture fills all its pairs at once: no stop is cut.
    assert browser.evaluate(f"gonio.views.machine.cell({half} - 1, 1) != gonio.views.machine.cell({half}, 1)")
    browser.evaluate("gonio.views.machine.play.click()")
    browser.wait(f"gonio.taken() > {half}")
    browser.evaluate("gonio.views.machine.play.click()")
    errors = [e["nrmse"] for e in browser.evaluate("gonio.data.machine.errors")]
    assert errors[-1] < 0.5 * errors[0]


def test_files_are_dropped(browser, pages):
    opened(browser, pages / "blank.html")
    drop = lambda name, data: (browser.drop("main", name, data), settle(browser))
    message = lambda: browser.evaluate("document.getElementById('said').textContent")
    browser.evaluate("""void (addEventListener("drop", () => { globalThis.start = performance.now() }, true), globalThis.watch = setInterval(() => {
        if (gonio.materials.length) { globalThis.end = performance.now(); clearInterval(watch) } }, 5))""")
    drop("first.binary", (pages / "a.binary").read_bytes())
    browser.wait("globalThis.end")
    assert browser.evaluate("end - start") < 1000
    value = browser.evaluate("gonio.views.directions.word && gonio.views.slices.curve(0)[300][1]")
    opened(browser, pages / "two.html")
    near(browser.evaluate("gonio.views.slices.curve(0)[300][1]"), value)
    drop("first.binary", (pages / "b.binary").read_bytes())
    assert browser.evaluate("gonio.materials.length") == 2
    drop("readings.csv", (pages / "few.csv").read_bytes())
    browser.wait("gonio.readings.length < 5000")
    header = struct.pack("<3i", 90, 90, 180)
    for name, data, words in [
        ("x.binary", b"", "header says nothing"), ("x.binary", struct.pack("<3i", 90, 90, 90), "90 × 90 × 90"), ("x.binary", header, "bytes"),
        ("x.txt", b"hello", "gonio explore"), ("x.csv", b"a,b\n1,2\n", "columns"), ("x.csv", b"theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n", "no reading"),
        ("<img src=x onerror=alert(1)>.csv", b"a\n", "<img"),
    ]:
        drop(name, data)
        browser.wait(f"document.getElementById('said').textContent.includes({json.dumps(words)})")
    assert browser.errors == [] and browser.requests == [], browser.errors


def test_bad_input_is_one_sentence_and_odd_input_a_page(browser, pages, gonio, tmp_path):
    at = lambda name: tmp_path / name
    black = struct.pack("<3i", 90, 90, 180) + bytes(8 * 3 * 90 * 90 * 180)
    at("black.binary").write_bytes(black)
    head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n"
    at("one.csv").write_text(head + "30,0,20,180,0.5\n")
    rng = np.random.default_rng(1)
    theta, phi = np.degrees(np.arccos(rng.random((2, 100_000)))) * 0.95, 360 * rng.random((2, 100_000))
    at("many.csv").write_text(head + "".join(f"{a:.4f},{b:.4f},{c:.4f},{d:.4f},0.3\n" for a, b, c, d in zip(theta[0], phi[0], theta[1], phi[1])))
    at("hostile.csv").write_bytes((pages / "few.csv").read_bytes())
    shutil.copy(at("hostile.csv"), at("<script>alert(1)</script>.csv".replace("/", "_")))
    for words, view in [((at("black.binary"),), "all of its values are 0"), (("--readings", at("one.csv")), None),
                        (("lambert", "lambert", "--readings", at("many.csv")), "every 20th"),
                        (("--readings", at("<script>alert(1)<_script>.csv")), None)]:
        gonio("explore", *words, "-o", at("page.html"), "--force")
        opened(browser, at("page.html"))
        settle(browser)
        assert browser.errors == [], (words, browser.errors)
        if view:
            assert view in browser.evaluate("document.getElementById('said').textContent")
    assert at("page.html").stat().st_size < 4e6
    at("poses.csv").write_text("theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n30,0,20,180\n")
    gonio("explore", "--schedule", at("poses.csv"), "-o", at("none.html"), code=2)
    gonio("explore", "nonsense", "-o", at("none.html"), code=2)
    assert not at("none.html").exists()


def test_python_has_the_page_of_the_command(browser, pages, tmp_path):
    a, b = (g.Material.open(str(pages / f"{name}.binary")) for name in "ab")
    page = g.explore(a, b)
    page.write(str(tmp_path / "page.html"))
    assert (tmp_path / "page.html").read_text() == page.html
    opened(browser, tmp_path / "page.html")
    mine = browser.evaluate("[gonio.data.errors, gonio.data.moments, gonio.data.distortion.map(d => d.shares)]")
    opened(browser, pages / "two.html")
    assert mine == browser.evaluate("[gonio.data.errors, gonio.data.moments, gonio.data.distortion.map(d => d.shares)]")
    # A notebook shows it in a frame, which may do nothing but run.
    shown = xml.dom.minidom.parseString(page._repr_html_()).documentElement
    assert (shown.tagName, shown.getAttribute("sandbox")) == ("iframe", "allow-scripts allow-downloads")
    assert shown.getAttribute("srcdoc") == page.html
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><body>{page._repr_html_()}</body>")
    browser.open((tmp_path / "notebook.html").as_uri())
    settle(browser)
    assert browser.errors == [] and browser.requests in ([], ["about:srcdoc"]), (browser.errors, browser.requests)
    readings = g.measure(a, g.plan("sobol", 40, "half-difference"))
    assert "readings by kriging" in g.explore(readings=readings).html
    with pytest.raises(ValueError, match="b: there is no a"):
        g.explore(b=b)
