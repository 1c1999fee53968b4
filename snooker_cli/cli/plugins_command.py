"""``snooker plugins``: what installed packages add."""

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.cli.output import print_result, print_table, print_wrapped
from snooker_cli.cli.parameters import takes


@takes(options.AS_JSON)
def plugins(*, as_json: bool) -> None:
    """List what snooker has, and what installed packages add.

    These are laws of collision, quantities, theories, figures, and formats of exports, each with
    its distribution and version. What could not be added is listed with the reason, and changes
    nothing else. docs/extending.md describes how to write a package.
    """
    rows = snooker.plugin_list()
    if as_json:
        print_result(rows, True, ())
        return
    added: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        source = row["group"], f"{row['distribution']} {row['version']}"
        added.setdefault(source, []).extend([row["name"]] * (not row["problem"]))
    table = [[*source, "; ".join(names)] for source, names in added.items() if names]
    print_table(["group", "from", "names"], table)
    if not any(row["entry"] for row in rows):
        print_wrapped(["No installed package adds to them."])
    print_wrapped(
        f"left out: {row['entry']} in {row['group']} of {row['distribution']} {row['version']}: "
        f"{row['problem']}"
        for row in rows
        if row["problem"]
    )
