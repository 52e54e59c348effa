"""NumPy opens the archives that gonio writes, and gonio those of NumPy."""

from conftest import needs, optional

np = optional("numpy")
pytestmark = needs("numpy")

MATERIAL = '[[material]]\nkind = "ggx"\nalpha = 0.3\n'


def test_numpy_reads_readings_and_writes_its_own(gonio, tmp_path):
    config = tmp_path / "scene.toml"
    config.write_text(MATERIAL)
    poses = tmp_path / "poses.npz"
    gonio("schedule", config, "--budget", 250, "-o", poses)
    readings = tmp_path / "readings.npz"
    gonio("measure", poses, "--config", config, "--instrument", "cornell", "--skip-unreachable", "-o", readings)
    read = np.load(readings, allow_pickle=False)
    light, sensor, value = read["omega_i"], read["omega_o"], read["value"]
    assert light.shape == sensor.shape == (len(value), 3)
    np.testing.assert_allclose(np.linalg.norm(light, axis=1), 1, atol=1e-15)
    theta, phi = np.radians(read["theta_i_deg"]), np.radians(read["phi_i_deg"])
    expected = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
    np.testing.assert_allclose(light, expected, atol=1e-15)
    known = ~np.isnan(value)
    assert known.any() and not known.all() and np.all(read["uncertainty"][known] > 0)
    assert set(read["flags"][~known]) <= {f for f in read["flags"] if f}
    # The same table as the CSV, to the bit.
    other = tmp_path / "readings.csv"
    gonio("measure", poses, "--config", config, "--instrument", "cornell", "--skip-unreachable", "-o", other)
    lines = [line for line in other.read_text().splitlines() if not line.startswith("#")]
    column = lines[0].split(",").index("value")
    cells = [line.split(",")[column] for line in lines[1:]]
    np.testing.assert_array_equal(value, [float(cell or "nan") for cell in cells])

    # What a program makes: vectors of any length, packed.
    mine = tmp_path / "mine.npz"
    np.savez_compressed(
        mine, omega_i=light[known] / 7, omega_o=sensor[known] * 3, value=value[known]
    )
    back = tmp_path / "back.npz"
    gonio("convert", mine, back)
    again = np.load(back)
    np.testing.assert_allclose(again["omega_i"], light[known], rtol=0, atol=1e-14)
    np.testing.assert_allclose(again["omega_o"], sensor[known], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(again["value"], value[known])
    gonio("reconstruct", mine, "--reconstruction", "nearest", "-o", tmp_path / "copy.binary")


def test_a_reconstruction_comes_on_any_grid(gonio, tmp_path):
    config, scene = tmp_path / "truth.toml", tmp_path / "scene.toml"
    config.write_text(MATERIAL)
    scene.write_text(f'[[material]]\nkind = "readings"\nfile = "{tmp_path}/mine.npz"\nreconstruction = {{ kind = "thin-plate" }}\n')
    poses, mine = tmp_path / "poses.npz", tmp_path / "mine.npz"
    gonio("schedule", config, "--budget", 300, "-o", poses)
    gonio("measure", poses, "--config", config, "-o", mine)
    # Where the readings are it has their values.
    gonio("measure", poses, "--config", scene, "-o", tmp_path / "again.npz")
    np.testing.assert_allclose(np.load(tmp_path / "again.npz")["value"], np.load(mine)["value"], rtol=1e-9)
    grid, copy = tmp_path / "grid.npz", tmp_path / "copy.npz"
    gonio("schedule", scene, "--budget", 5000, "-o", grid)
    gonio("measure", grid, "--config", scene, "-o", copy)
    grid, copy = np.load(grid), np.load(copy)
    for name in ("theta_h_deg", "theta_d_deg", "phi_d_deg", "omega_i", "omega_o"):
        np.testing.assert_array_equal(copy[name], grid[name])
    assert len(copy["value"]) > 4000 and np.all(copy["value"] > 0)


def test_what_is_no_table_is_refused(gonio, tmp_path):
    np.savez(tmp_path / "bad.npz", omega_i=np.ones((4, 3)), value=np.ones((4, 2)))
    gonio("reconstruct", tmp_path / "bad.npz", "-o", tmp_path / "c.binary", code=3)
    (tmp_path / "text.npz").write_text("theta_i_deg,value\n")
    gonio("reconstruct", tmp_path / "text.npz", "-o", tmp_path / "c.binary", code=3)
