"""The flocks: their list, and the reel of one with its ground truth, figures, files, links and deletion."""

import array
import io
import re
import subprocess
import urllib.error
import urllib.request
import zipfile

import pytest
import zxingcpp
from playwright.sync_api import expect

from service import post, wait_for_job
from steps import LOAD_MS, fetch, get, heading, say, until

pytestmark = pytest.mark.thorough

UNDO_MS = 10_000


@pytest.fixture(scope="module")
def flock(filled_service):
    """The flock of the filled service."""
    return get(f"{filled_service}/v1/flocks")["items"][-1]


@pytest.fixture
def reel(page, filled_service, flock):
    """A page that shows the reel at rest, one second after its start."""
    return opened(page, f"{filled_service}/flocks/{flock['id']}?t=1")


def opened(page, address):
    page.goto(address)
    expect(page.locator(".reel-strip").first).to_be_visible(timeout=LOAD_MS)
    until(page, "document.querySelector('.stage video').readyState > 1 && !document.querySelector('.stage video').seeking")
    return page


def another_flock(address, **params):
    """Makes a flock of the film and returns its id."""
    library = get(f"{address}/v1/libraries")["items"][0]
    made = post(f"{address}/v1/flocks", {"library_id": library["id"], "count": 2, "frames": 30, **params})
    wait_for_job(address, made["job_id"])
    return made["flock_id"]


def exists(address):
    try:
        urllib.request.urlopen(address)
        return True
    except urllib.error.HTTPError:
        return False


def colored_pixels(page):
    """Number of pixels of the layer over the film that are not transparent."""
    script = """(canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let n = 0;
        for (let k = 3; k < data.length; k += 4) n += data[k] > 0;
        return n;
    }"""
    return page.locator("canvas.truth").evaluate(script)


def test_a_link_with_a_moment_shows_that_frame_at_rest(reel, flock):
    frame = round(flock["fps"])
    expect(reel.locator(".time")).to_contain_text(f"frame {frame}")
    shown = reel.locator(".stage video").evaluate("(video) => video.currentTime")
    assert int(shown * flock["fps"]) == frame
    assert reel.locator(".stage video").evaluate("(video) => video.paused")


def test_keys_and_the_slider_move_film_figures_and_address(reel, flock):
    reel.locator("h1").click()
    reel.keyboard.press("End")
    last = flock["frames"] - 1
    expect(reel.locator(".time")).to_contain_text(f"frame {last}")
    until(reel, f"Math.floor(document.querySelector('.stage video').currentTime * {flock['fps']}) === {last}")
    assert re.search(r"\?t=\d", reel.url)
    reel.keyboard.press("Space")
    expect(reel).to_have_url(re.compile(rf"/flocks/{flock['id']}$"))


def test_the_strips_tell_the_figures_of_the_plan(reel, filled_service, flock):
    told = get(f"{filled_service}/v1/flocks/{flock['id']}/flock.json")["stats"]["per_frame"]
    frame = round(flock["fps"])
    for k, name in enumerate(["polarization", "milling", "nearest_neighbor_bl"]):
        expect(reel.locator(".reel-strip output").nth(k)).to_contain_text(f"{told[name][frame]:.2f}")
    box = reel.locator(".reel-strip svg").first.bounding_box()
    reel.mouse.click(box["x"] + box["width"] / 2, box["y"] + 5)
    expect(reel.locator(".time")).to_contain_text(re.compile(rf"frame {(flock['frames'] - 1) // 2}|frame {flock['frames'] // 2}"))


def test_the_ground_truth_is_drawn_over_the_film_and_told_in_a_table(reel, flock):
    expect(reel.locator("canvas.truth")).to_be_hidden()
    reel.get_by_role("checkbox", name="Boxes").check(force=True)
    expect(reel.locator("canvas.truth")).to_have_attribute("aria-label", re.compile(rf"frame \d+: {flock['count']} animals"), timeout=LOAD_MS)
    boxes = colored_pixels(reel)
    assert boxes > 100
    reel.get_by_role("checkbox", name="Shapes").check(force=True)
    until(reel, lambda: colored_pixels(reel) > 2 * boxes)
    expect(reel).to_have_url(re.compile("truth=boxes,shapes"))
    reel.get_by_text("Ground truth of this frame as a table").click()
    expect(reel.locator(".truth-table tbody tr")).to_have_count(flock["count"])


def test_boxes_lie_where_the_ground_truth_says(reel, filled_service, flock):
    reel.get_by_role("checkbox", name="Boxes").check(force=True)
    expect(reel.locator("canvas.truth")).to_have_attribute("aria-label", re.compile(f"{flock['count']} animals"), timeout=LOAD_MS)
    text = urllib.request.urlopen(f"{filled_service}/v1/flocks/{flock['id']}/tracks.csv").read().decode()
    head, *rows = [line.split(",") for line in text.splitlines()]
    frame = str(round(flock["fps"]))
    boxes = [dict(zip(head, row)) for row in rows if row[0] == frame]
    script = """(canvas, { x, y, size }) => {
        const zoom = Math.min(canvas.width / size[0], canvas.height / size[1]);
        const at = [(canvas.width - size[0] * zoom) / 2 + x * zoom, (canvas.height - size[1] * zoom) / 2 + y * zoom].map(Math.round);
        return canvas.getContext("2d").getImageData(at[0], at[1], 1, 1).data[3];
    }"""
    for box in boxes:
        x = float(box["visible_x_px"]) + float(box["visible_w_px"]) / 2
        y = float(box["visible_y_px"])
        if 2 < x < flock["image_size_px"][0] - 2 and 2 < y < flock["image_size_px"][1] - 2:
            point = {"x": x, "y": y, "size": flock["image_size_px"]}
            assert reel.locator("canvas.truth").evaluate(script, point) > 0


def mask_of(address, frame):
    """Returns the labels of the ground truth of a frame, row by row, and the width."""
    with zipfile.ZipFile(io.BytesIO(fetch(f"{address}/ground-truth.zip"))) as truth:
        png = truth.read(f"masks/{frame:06d}.png")
    command = ["ffmpeg", "-v", "error", "-f", "png_pipe", "-i", "-", "-f", "rawvideo", "-pix_fmt", "gray16le", "-"]
    raw = subprocess.run(command, input=png, check=True, capture_output=True).stdout
    return array.array("H", raw), int.from_bytes(png[16:20], "big")


# The opacity of the layer at the middle of every pixel of the film.
OPACITY = """(canvas, [width, height]) => {
    const zoom = Math.min(canvas.width / width, canvas.height / height);
    const [left, top] = [(canvas.width - width * zoom) / 2, (canvas.height - height * zoom) / 2];
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let text = "";
    for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
        const [u, v] = [Math.floor(left + (x + 0.5) * zoom), Math.floor(top + (y + 0.5) * zoom)];
        text += data[4 * (v * canvas.width + u) + 3] > 60 ? "1" : "0";
    }
    return text;
}"""


def test_the_shapes_are_the_masks_within_a_pixel(reel, filled_service, flock):
    reel.get_by_role("checkbox", name=say(reel, "reel.truth.shapes")).check(force=True)
    mask, width = mask_of(f"{filled_service}/v1/flocks/{flock['id']}", round(flock["fps"]))
    height = len(mask) // width
    until(reel, lambda: "1" in reel.locator("canvas.truth").evaluate(OPACITY, [width, height]))
    shown = reel.locator("canvas.truth").evaluate(OPACITY, [width, height])
    n_inside = n_outside = n_wrong = 0
    for y in range(2, height - 2):
        for x in range(2, width - 2):
            at = y * width + x
            around = mask[at - width - 1 : at - width + 2] + mask[at - 1 : at + 2] + mask[at + width - 1 : at + width + 2]
            is_inside = all(around)
            if is_inside or not any(around):
                n_inside += is_inside
                n_outside += not is_inside
                n_wrong += (shown[at] == "1") != is_inside
    assert n_inside > 500 and n_outside > 500
    assert n_wrong < 0.01 * n_inside, (n_wrong, n_inside)


def test_the_living_view_keeps_the_moment(reel, flock):
    reel.get_by_text("Live", exact=True).click()
    expect(reel.locator(".living canvas")).to_be_visible(timeout=LOAD_MS)
    expect(reel.locator(".time")).to_contain_text(f"frame {round(flock['fps'])}")
    expect(reel).to_have_url(re.compile("view=living"))
    reel.locator("h1").click()
    reel.keyboard.press("ArrowRight")
    expect(reel.locator(".time")).to_contain_text(f"frame {round(flock['fps']) + 1}")


def test_the_table_lists_the_files_that_exist_with_their_sizes(reel, filled_service, flock):
    names = reel.locator(".files tbody th").all_text_contents()
    assert "video.mp4" in names
    assert "tracks.csv" in names
    assert "video.webm" not in names
    for name in names:
        assert exists(f"{filled_service}/v1/flocks/{flock['id']}/{name}")
    expect(reel.locator(".files .size").first).to_contain_text(re.compile("[kM]B"))


def test_a_page_for_friends_plays_the_film_without_a_token(reel, browser, flock):
    reel.get_by_role("button", name="Make a link").click()
    link = reel.locator(".links pre").text_content()
    context = browser.new_context()
    friend = context.new_page()
    asked = []
    friend.on("request", lambda request: asked.append(request.url) if "/v1/" in request.url else None)
    friend.goto(link)
    expect(heading(friend)).to_contain_text(f"{flock['count']} × goldfish")
    expect(friend.locator(".reel-strip").first).to_be_visible(timeout=LOAD_MS)
    until(friend, "document.querySelector('.stage video').readyState > 1")
    assert asked
    assert all("signature=" in url for url in asked)
    # The first bytes of a signature are its expiry: here a second of the year 2001.
    friend.goto(re.sub(r"~[\w-]{5}", "~O5rKA", link))
    expect(heading(friend)).to_have_text(say(friend, "shared.over"))
    friend.goto(link.rsplit("~", 1)[0])
    expect(heading(friend)).to_have_text(say(friend, "shared.broken"))
    context.close()


# The brightness of a drawn QR code, as hexadecimal digits, and its width.
BRIGHTNESS = """async (svg) => {
    const side = 6 * svg.viewBox.baseVal.width;
    const file = new XMLSerializer().serializeToString(svg).replace(/ width="\\d+"/, ` width="${side}" height="${side}"`);
    const picture = Object.assign(new Image(), { src: `data:image/svg+xml,${encodeURIComponent(file)}` });
    await picture.decode();
    const context = Object.assign(document.createElement("canvas"), { width: side, height: side }).getContext("2d");
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 0, side, side);
    return [Array.from({ length: side * side }, (_, k) => (data[4 * k] > 127 ? "f" : "0")).join(""), side];
}"""


def read_qr(svg):
    """Returns the text of a drawn QR code."""
    light, side = svg.evaluate(BRIGHTNESS)
    picture = memoryview(bytes(255 * (one == "f") for one in light)).cast("B", (side, side))
    return [found.text for found in zxingcpp.read_barcodes(picture)]


def test_the_qr_code_of_a_link_is_read_as_the_link(reel):
    reel.get_by_role("button", name="Make a link").click()
    link = reel.locator(".links pre").text_content()
    reel.get_by_text(say(reel, "reel.link.qr"), exact=True).click()
    code = reel.get_by_role("img", name=say(reel, "reel.link.qr"))
    assert read_qr(code) == [link]
    draw = """(svg, text) => import("/static/js/reel/qr.js").then(({ qrOf, qrPicture }) => svg.replaceWith(qrPicture(qrOf(text), svg.getAttribute("aria-label"))))"""
    for length in (30, 54, 79, 107, 135, 155, 193, 231, 272, 300, 367, 425):
        text = (link * 3)[:length]
        code.evaluate(draw, text)
        assert read_qr(code) == [text], length


def test_a_page_for_friends_ends_when_the_flock_is_deleted(page, visitor, filled_service):
    flock = another_flock(filled_service, seed=9)
    opened(page, f"{filled_service}/flocks/{flock}?t=0")
    page.get_by_role("button", name=say(page, "reel.link.make")).click()
    link = page.locator(".links pre").text_content()
    urllib.request.urlopen(urllib.request.Request(f"{filled_service}/v1/flocks/{flock}", method="DELETE")).close()
    friend = visitor()
    friend.goto(link)
    expect(heading(friend)).to_have_text(say(friend, "shared.gone"))


def test_a_link_for_friends_opens_the_file_without_a_token(reel):
    reel.get_by_label("What to share").select_option("tracks.csv")
    reel.get_by_role("button", name="Make a link").click()
    expect(reel.locator(".links li")).to_contain_text("works until")
    link = reel.locator(".links pre").text_content()
    assert urllib.request.urlopen(link).read(5) == b"frame"


def test_the_studio_opens_with_the_settings_of_the_flock(page, filled_service):
    flock = another_flock(filled_service, seed=5, preset="swarm", render={"background": "#102030"})
    opened(page, f"{filled_service}/flocks/{flock}?t=0")
    href = page.get_by_role("link", name="Change it in the studio").get_attribute("href")
    assert "seed=5" in href
    assert "render.background=%23102030" in href
    assert "w_h" not in href
    page.get_by_role("link", name="Change it in the studio").click()
    expect(page.locator(".studio-stage canvas")).to_have_attribute("aria-label", re.compile("^2 animals"), timeout=LOAD_MS)
    body = {"library_id": get(f"{filled_service}/v1/flocks/{flock}")["library_id"], "count": 2, "frames": 30, "seed": 5, "preset": "swarm"}
    kept = get(f"{filled_service}/v1/flocks/{flock}/flock.json")["individuals"]
    assert post(f"{filled_service}/v1/flocks/preview", body)["individuals"] == kept


def test_deleting_can_be_undone_for_ten_seconds(page, filled_service):
    flock = another_flock(filled_service, seed=6)
    address = f"{filled_service}/v1/flocks/{flock}"
    page.clock.install()
    page.goto(f"{filled_service}/flocks")
    card = page.locator(f'.card-small:has(a[href="/flocks/{flock}"])')
    card.get_by_role("button", name="Delete").click()
    expect(card).to_be_hidden()
    expect(page.get_by_role("button", name="Undo")).to_be_focused()
    page.keyboard.press("Enter")
    expect(card).to_be_visible()
    page.clock.fast_forward(UNDO_MS + 500)
    expect(card).to_be_visible()
    assert exists(address)
    card.get_by_role("button", name="Delete").click()
    page.clock.fast_forward(UNDO_MS - 2000)
    expect(page.get_by_role("button", name="Undo")).to_be_visible()
    assert exists(address)
    page.clock.fast_forward(3000)
    until(page, lambda: not exists(address))


def test_a_reel_that_is_deleted_goes_to_the_list_and_is_gone_when_the_page_closes(page, filled_service):
    flock = another_flock(filled_service, seed=7)
    opened(page, f"{filled_service}/flocks/{flock}?t=0")
    page.get_by_role("button", name="Delete").click()
    expect(page).to_have_url(re.compile("/flocks$"))
    expect(page.locator(f'.card-small a[href="/flocks/{flock}"]')).to_be_hidden()
    page.goto("about:blank")
    until(page, lambda: not exists(f"{filled_service}/v1/flocks/{flock}"))


def test_flocks_and_films_are_pinned_in_their_lists(page, filled_service, flock):
    footage = get(f"{filled_service}/v1/footage")["items"][0]
    for place, noun, thing in (("flocks", "flocks", flock), ("films", "footage", footage)):
        for pinned in (True, False):
            page.goto(f"{filled_service}/{place}")
            pin = page.locator(f'.card-small:has(a[href="/{place}/{thing["id"]}"])').get_by_role("button", name=re.compile("^Pin: "))
            expect(pin).to_have_attribute("aria-pressed", "false" if pinned else "true", timeout=LOAD_MS)
            pin.press("Enter")
            expect(pin).to_have_attribute("aria-pressed", "true" if pinned else "false")
            assert get(f"{filled_service}/v1/{noun}/{thing['id']}")["pinned"] == pinned
    expect(page.get_by_text(re.compile(r"^Your films and flocks take [\d.]+ MB of 34\.4 GB\.$"))).to_be_visible()


def test_the_list_is_searched_by_the_name_of_the_film(page, filled_service):
    page.goto(f"{filled_service}/flocks")
    cards = page.locator(".card-small:visible")
    expect(cards.first).to_be_visible()
    page.get_by_role("searchbox").fill("GOLD")
    expect(cards.first).to_be_visible()
    page.get_by_role("searchbox").fill("mouse")
    expect(cards).to_have_count(0)
    expect(page).to_have_url(re.compile("q=mouse"))


def test_a_flock_that_is_being_made_appears_by_itself(page, filled_service):
    page.goto(f"{filled_service}/flocks")
    flock = another_flock(filled_service, seed=8)
    expect(page.locator(f'.card-small a[href="/flocks/{flock}"]')).to_be_visible(timeout=LOAD_MS)
