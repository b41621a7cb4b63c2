


def test_an_empty_file_is_no_password(tmp_path: Path) -> None:
    file = tmp_path / "password.txt"
    file.write_text("\n")
    options = ["--user", "a", "--password-file", str(file), "--browse"]
    answer = CliRunner().invoke(main, ["attach", "opc.tcp://127.0.0.1:1", *options])
    assert answer.exit_code == 1 and missing(answer.output, str(file), "line 1", "empty", "password") == []
