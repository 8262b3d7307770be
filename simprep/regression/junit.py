"""A comparison as JUnit XML, which build servers show: a test for each metric of each case."""

from pathlib import Path
from xml.etree import ElementTree

from simprep.files import atomic_path
from simprep.regression.compare import NEW, Comparison
from simprep.regression.tables import cells


def save_junit(comparison: Comparison, path: str | Path) -> Path:
    """Write a comparison as JUnit XML, atomically: failures with before, now and what is allowed; new numbers as skipped."""
    failures = set(map(id, comparison.failures))
    skipped = sum(row.verdict == NEW for row in comparison.rows)
    counts = {"tests": len(comparison.rows), "failures": len(failures), "errors": 0, "skipped": skipped}
    numbers = {key: str(value) for key, value in counts.items()}
    root = ElementTree.Element("testsuites", numbers)
    suite = ElementTree.SubElement(root, "testsuite", {"name": "simprep check", **numbers})
    if comparison.differences:
        properties = ElementTree.SubElement(suite, "properties")
        for index, line in enumerate(comparison.differences):
            ElementTree.SubElement(properties, "property", {"name": f"difference_{index}", "value": line})
    for row in comparison.rows:
        test = ElementTree.SubElement(suite, "testcase", {"classname": row.case, "name": row.metric})
        before, now, change, allowed, _ = cells(row)
        if id(row) in failures:
            text = f"{row.verdict}: {before} before, {now} now ({change}); allowed {allowed}"
            ElementTree.SubElement(test, "failure", {"message": text, "type": row.verdict}).text = "\n".join(
                (text, *comparison.differences)
            )
        elif row.verdict == NEW:
            ElementTree.SubElement(test, "skipped", {"message": "not in the baseline"})
    ElementTree.indent(root)
    with atomic_path(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
    return Path(path)
