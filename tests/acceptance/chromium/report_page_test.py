#!/usr/bin/python3
"""The report page in headless Chromium.

    report_page_test.py --smoothpost TOOL --source ROOT --work DIR

Converts the bent sheet with its part (a laser) and the milling sample, opens their pages from disk, and looks at
what an engineer would:
  1. nothing in the console, no request but the file itself, below 5 MB,
  2. the 3D view draws: part and both paths are on the canvas,
  3. a click on a point of the path picks it: its lines are those of the line map, its joints those of the program's
     line, its tip the input's point within the tolerance,
  4. mouse and keys turn, move and zoom; comma and full stop go from line to line,
  5. the time slider moves the head: joints in between those of its neighbours, cursors in the plots move along,
  6. the columns of tables sort both ways,
  7. with scripts off verdict, checks and plots are there; it prints,
  8. a program whose name and comments hold tags runs no script of theirs.
Prints what it found. Exit status: 0 all hold, 1 not, 77 no Chromium here (and why).
"""
import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

from browser import SKIP, Browser, BrowserError, find_browser

FAILURES = []


def expect(condition, text):
    print(("ok      " if condition else "FAILED  ") + text)
    if not condition:
        FAILURES.append(text)


def convert(options, name, arguments, input_file):
    page, program, lines = (options.work / f"{name}{end}" for end in (".html", ".ngc", "_lines.json"))
    run = subprocess.run([options.smoothpost, "convert", str(input_file), *arguments, "-o", str(program), "--report", str(page),
                          "--line-map", str(lines), "--plots", str(options.work / (name + "_plots"))],
                         capture_output=True, text=True)
    expect(run.returncode == 0, f"{name}: converted ({run.stderr.strip().splitlines()[-1:]})")
    return page, program, lines


def quiet(browser, page, name):
    browser.settle()
    complaints, requests = browser.complaints(), browser.requests()
    expect(not complaints, f"{name}: nothing in the console {complaints}")
    expect(requests == [page.absolute().as_uri()], f"{name}: no request but the page itself")
    expect(page.stat().st_size < 5_000_000, f"{name}: {page.stat().st_size} bytes")
    expect(browser.value("document.documentElement.dataset.ready") == "yes", f"{name}: the script ran to its end")


def canvas_pixels(browser):
    """How many pixels of the canvas are part (grey), program (blue), input (orange)."""
    return browser.value("""(() => {
      const source = document.querySelector('#view canvas'), copy = document.createElement('canvas');
      copy.width = source.width; copy.height = source.height;
      const pen = copy.getContext('2d'); pen.drawImage(source, 0, 0);
      const d = pen.getImageData(0, 0, copy.width, copy.height).data;
      let part = 0, program = 0, input = 0;
      for (let i = 0; i < d.length; i += 4) {
        const [r, g, b] = [d[i], d[i + 1], d[i + 2]];
        if (Math.abs(r - g) < 12 && b - r < 16 && b >= r && r > 60 && r < 240) ++part;
        if (Math.abs(r - 31) < 30 && Math.abs(g - 78) < 30 && Math.abs(b - 156) < 30) ++program;
        if (Math.abs(r - 208) < 30 && Math.abs(g - 138) < 30 && Math.abs(b - 29) < 40) ++input;
      }
      return {part, program, input, all: d.length / 4};
    })()""")


def drawn(browser, name, with_part):
    # At once: clicks would miss while the page still glides.
    browser.value("""window.scrollTo({top: document.getElementById('view').getBoundingClientRect().top + scrollY - 20,
      behavior: 'instant'}); 1""")
    browser.settle()
    pixels = canvas_pixels(browser)
    expect(pixels["program"] > 200, f"{name}: the program is drawn ({pixels})")
    expect(pixels["input"] > 100, f"{name}: the input is drawn")
    if with_part:
        expect(pixels["part"] > 5000, f"{name}: the part is drawn")


VIEW = "smoothpost.view"


def picking(browser, name, program, lines):
    rows = {row[0]: row for row in json.loads(lines.read_text())["rows"]}
    text = program.read_text().splitlines()
    count = browser.value(f"{VIEW}.count")
    browser.value("document.getElementById('marks').hidden = true")  # a label may lie over a point
    hit = 0
    for share in (0.15, 0.4, 0.63, 0.85):
        i = int(share * count)
        while browser.value(f"{VIEW}.isLink({i})"):
            i += 1
        x, y = browser.value(f"{VIEW}.screenOf({i})")
        browser.value(f"{VIEW}.select(0)")
        browser.click(x, y)
        got = browser.value(f"{VIEW}.state.index")
        near = browser.value(f"(([a, b]) => Math.hypot(a - {x}, b - {y}))({VIEW}.screenOf({got}))")
        input_line, output_line = browser.value(f"{VIEW}.linesOf({got})")
        panel = browser.value("document.getElementById('place').innerText")
        if near < 2 and f"{output_line}" in panel and f"{input_line}" in panel:
            hit += 1
        # Mapped to a segment of that input line; a block in the place of several has the last one's.
        expect(output_line in rows and input_line <= rows[output_line][1], f"{name}: point {got} is on a line of the map")
        expect(text[output_line - 1][:40] in panel, f"{name}: the panel shows output line {output_line}")
    expect(hit == 4, f"{name}: {hit} of 4 clicks picked the point under the mouse")
    browser.value(f"{VIEW}.select(0)")
    browser.click(*browser.value("(r => [r.left + 3, r.top + 3])(document.querySelector('#view canvas').getBoundingClientRect())"))
    expect(browser.value(f"{VIEW}.state.index") == 0, f"{name}: a click beside the path picks nothing")


def joints_of_lines(browser, name, program, letters):
    """Joints at the ends of lines against the words that the program has there."""
    modal, last, worst, compared = {}, {}, 0.0, 0
    for number, line in enumerate(program.read_text().splitlines(), 1):
        code = re.sub(r"\([^)]*\)", "", line)
        for letter, value in re.findall(r"([XYZABCUVW])(-?\d+\.?\d*)", code):
            if re.search(r"\bG1\b|\bG0\b", code):
                modal[letter] = float(value)
        last[number] = dict(modal)
    ends = browser.value(f"""(() => {{ const v = {VIEW}, out = [];
      for (let i = 0; i + 1 < v.count; i += 1)
        if (v.linesOf(i)[1] !== v.linesOf(i + 1)[1]) out.push([v.linesOf(i)[1], v.jointsOf(i)]);
      return out; }})()""")
    for number, joints in ends:
        words = last.get(number, {})
        if any(letter not in words for letter in letters):
            continue
        compared += 1
        worst = max(worst, max(abs(words[letter] - q) for letter, q in zip(letters, joints)))
    expect(compared > 20 and worst < 2e-5, f"{name}: joints at {compared} line ends are the program's words within {worst:.1e}")


def orbit(browser, name):
    box = browser.value("(r => [r.left, r.top, r.width, r.height])(document.querySelector('#view canvas').getBoundingClientRect())")
    middle = [box[0] + box[2] / 2, box[1] + box[3] / 2]
    place = lambda: browser.value(f"{VIEW}.screenOf(Math.floor({VIEW}.count / 3))")
    index = browser.value(f"{VIEW}.state.index")
    before = place()
    browser.drag(middle, [middle[0] + 120, middle[1] + 40])
    browser.settle()
    expect(place() != before, f"{name}: dragging turns the view")
    expect(browser.value(f"{VIEW}.state.index") == index, f"{name}: dragging picks nothing")
    browser.value("document.querySelector('#view canvas').focus(); 1")
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "1", "2", "3"):
        before = place()
        browser.key(key)
        expect(place() != before, f"{name}: key {key} changes the view")
    browser.key("Home")
    first = place()
    browser.mouse("mouseWheel", *middle, deltaX=0, deltaY=-240)
    browser.settle()
    expect(place() != first, f"{name}: the wheel zooms")
    browser.key("Home")
    expect(place() == first, f"{name}: Home brings the first view back")
    browser.value(f"{VIEW}.select(Math.floor({VIEW}.count / 2))")
    line = browser.value(f"{VIEW}.linesOf({VIEW}.state.index)[1]")
    browser.key(".")  # to the end of the line that the point is in, then of the next
    browser.key(".")
    expect(browser.value(f"{VIEW}.linesOf({VIEW}.state.index)[1]") > line, f"{name}: full stop goes to the next line")
    for _ in range(3):
        browser.key(",")
    expect(browser.value(f"{VIEW}.linesOf({VIEW}.state.index)[1]") < line, f"{name}: comma goes back")


def time_slider(browser, name):
    found = browser.value(f"""(() => {{
      const slider = document.querySelector('#time input'), v = {VIEW};
      const at = (share) => {{ slider.value = String(share * Number(slider.max)); slider.dispatchEvent(new Event('input'));
        return {{time: v.state.time, joints: v.state.joints.slice(), cursor: document.querySelector('svg.of-time line:last-child').getAttribute('x1')}}; }};
      return [at(0.2), at(0.5), at(0.8), Number(slider.max)]; }})()""")
    a, b, c, end = found
    expect(end > 1.0 and abs(b["time"] - 0.5 * end) < 1e-6, f"{name}: the slider spans {end:.2f} s")
    expect(a["joints"] != b["joints"] != c["joints"], f"{name}: the slider moves the joints")
    expect(float(a["cursor"]) < float(b["cursor"]) < float(c["cursor"]), f"{name}: the cursors of the plots move along")
    frames = int(browser.value("document.querySelector('#view canvas').dataset.frames"))
    browser.value("[...document.querySelectorAll('#time button')][0].click(); 1")
    browser.value(f"""new Promise(done => {{ const start = performance.now(), look = () =>
      {VIEW}.state.time > {c["time"]} || performance.now() - start > 20000 ? done(1) : setTimeout(look, 50); look(); }})""")
    browser.settle()
    browser.value("[...document.querySelectorAll('#time button')][0].click(); 1")
    later = browser.value(f"{VIEW}.state.time")
    expect(later > c["time"] or later == end, f"{name}: playing lets the time run")
    expect(int(browser.value("document.querySelector('#view canvas').dataset.frames")) > frames, f"{name}: and draws")


def sorting(browser, name):
    result = browser.value("""(() => { const out = [];
      for (const table of document.querySelectorAll('table.sortable')) {
        if (table.tBodies[0].rows.length < 3) continue;
        [...table.tHead.rows[0].cells].forEach((cell, column) => {
          if (!cell.classList.contains('number')) return;
          const values = () => [...table.tBodies[0].rows].map(r => parseFloat(r.cells[column].textContent)).filter(v => !isNaN(v));
          cell.querySelector('button').click();
          const down = values();
          cell.querySelector('button').click();
          const up = values();
          out.push(down.length === up.length && down.every((v, i) => i === 0 || down[i - 1] >= v) && up.every((v, i) => i === 0 || up[i - 1] <= v)
            && cell.getAttribute('aria-sort') === 'ascending');
        });
      } return out; })()""")
    expect(len(result) >= 5 and all(result), f"{name}: {sum(result)} of {len(result)} columns of numbers sort both ways")


def without_scripts(browser, page, name, work):
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    browser.open(page)
    shot = work / f"{name}_still.png"
    browser.screenshot(shot)
    text = browser.call("Runtime.evaluate", expression="document.body.innerText", returnByValue=True)["result"].get("value", "")
    expect("CERTIFIED" in text and "tip_deviation" in text and "Not checked" in text, f"{name}: with scripts off the verdict can be read")
    expect("needs scripts" in text, f"{name}: and the page says what is missing")
    pdf = browser.pdf()
    expect(pdf.startswith(b"%PDF") and len(pdf) > 20000, f"{name}: it prints ({len(pdf)} bytes of PDF)")
    browser.call("Emulation.setScriptExecutionDisabled", value=False)


def hostile(browser, options):
    """Comments and a file name with tags; the name is as bad as a file system allows."""
    tag = "<img src=x onerror=document.title=1>"
    source = (options.source / "examples/mill_ac/mill_ac.ngc").read_text()
    lines = source.splitlines()
    lines.insert(8, "(</script><script>document.title='taken'<!script>" + tag + ")")
    file = options.work / f"a{tag}&amp;.ngc"
    file.write_text("\n".join(lines) + "\n")
    page, _, _ = convert(options, "hostile", MILL + ["-m", "table_table_bc"], file)
    browser.open(page)
    quiet(browser, page, "hostile")
    expect(tag in browser.value("document.title"), "hostile: the title is the file's name, letter by letter")
    expect(browser.value("document.querySelectorAll('img, iframe, object, embed').length") == 0, "hostile: no element of theirs")
    expect(browser.value("document.querySelectorAll('script').length") == 2, "hostile: no script of theirs")


MILL = ["--input-machine", "table_table_ac", "--tool", "1=60"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("--source", required=True, type=Path)
    parser.add_argument("--work", required=True, type=Path)
    options = parser.parse_args()
    program = find_browser()
    if not program:
        print("skipped: no chromium on PATH (Debian package chromium)")
        return SKIP
    options.work.mkdir(parents=True, exist_ok=True)
    sheet = options.source / "examples/bent_sheet"
    laser = ["--input-machine", "laser_5p1", "-m", "laser_5p1", "-w", str(sheet / "bent_sheet.stl"), "--work-offset", "G54=700,600,1000"]
    cases = [
        ("laser", convert(options, "laser", laser, sheet / "bent_sheet.ngc"), "XYZCBU", True),
        ("mill", convert(options, "mill", MILL + ["-m", "table_table_bc"], options.source / "examples/mill_ac/mill_ac.ngc"), "XYZBC", False)]
    if FAILURES:
        return 1
    try:
        browser = Browser(program)
    except (BrowserError, OSError) as error:
        print(f"skipped: {program} cannot be started here: {error}")
        return SKIP
    with browser:
        for name, (page, text, lines), letters, with_part in cases:
            browser.open(page)
            quiet(browser, page, name)
            drawn(browser, name, with_part)
            picking(browser, name, text, lines)
            joints_of_lines(browser, name, text, letters)
            orbit(browser, name)
            time_slider(browser, name)
            sorting(browser, name)
            complaints = browser.complaints()
            expect(not complaints, f"{name}: still nothing in the console {complaints}")
            without_scripts(browser, page, name, options.work)
        hostile(browser, options)
    print(f"{len(FAILURES)} of the expectations failed")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
