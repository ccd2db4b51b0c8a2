#include "batch/set_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "batch/mesh_record.h"
#include "console/progress_line.h"
#include "console/version.h"
#include "files/html_page.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/render/markup.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::string_view kSetStyle = R"(
body { max-width: none; }
.choices { display: flex; flex-wrap: wrap; gap: .8rem; align-items: center; margin: 1.6rem 0 .6rem; }
.choices input, .choices select, .choices button { font: inherit; padding: .25rem .5rem; }
.choices input { flex: 1; min-width: 12rem; }
.choices output { color: var(--quiet); }
#meshes th, #meshes td { padding-right: .8rem; vertical-align: middle; overflow-wrap: normal; }
#meshes th.number, #meshes td.number { text-align: right; white-space: nowrap; }
#meshes th button { all: unset; cursor: pointer; }
#meshes th button:focus-visible { outline: 2px solid var(--bar); }
#meshes img { display: block; height: 5.5rem; border-radius: 4px; }
#meshes td.files { min-width: 9rem; }
#meshes .files a { display: inline-block; margin-right: .5rem; white-space: nowrap; }
#meshes td.file { min-width: 13rem; overflow-wrap: anywhere; }
#meshes td.told { font-weight: 600; }
#meshes small.told { color: inherit; }
#meshes small { display: block; color: var(--quiet); overflow-wrap: anywhere; }
)";

// Shows a hundred meshes at a time, so that pages of many thousands stay quick.
constexpr std::string_view kSetScript = R"(<script>
const kRows = 100;
const columns = [
  { title: 'mesh', of: (m) => m.file },
  { title: 'status', of: (m) => m.status },
  { title: 'cells', of: (m) => m.leaves, number: (n) => n.toLocaleString('en') },
  { title: 'file, kB', of: (m) => m.bytes, number: (n) => (n / 1000).toLocaleString('en', { maximumFractionDigits: 1 }) },
  { title: 'near RMS', of: (m) => m.rms, number: (n) => n.toPrecision(3) },
  { title: 'near max', of: (m) => m.max, number: (n) => n.toPrecision(3) },
  { title: 'torn, %', of: (m) => m.torn, number: (n) => (100 * n).toPrecision(3) },
  { title: 'seconds', of: (m) => m.seconds, number: (n) => n.toFixed(2) },
];
const meshes = JSON.parse(document.getElementById('data').textContent);
const search = document.getElementById('search'), only = document.getElementById('only');
const table = document.getElementById('meshes'), count = document.getElementById('count');
const before = document.getElementById('before'), after = document.getElementById('after');
let first = 0, sorted = 0, falling = false;

function element(name, text = '', type = '') {
  const made = document.createElement(name);
  made.textContent = text;
  made.className = type;
  return made;
}
function link(mesh, ending, text) {
  const made = element('a', text);
  made.href = encodeURIComponent(mesh.name + ending);
  return made;
}
function row(mesh) {
  const cells = columns.map(({ of, number }) => {
    const value = of(mesh);
    return element('td', value === null ? '–' : number ? number(value) : value, number ? 'number' : '');
  });
  cells[0].className = 'file';
  cells[0].append(element('small', mesh.name));
  if (mesh.told !== null) {
    cells[0].append(element('small', mesh.told, 'told'));
    cells[1].className = 'told';
  }
  const picture = element('td'), files = element('td', '', 'files');
  const image = mesh.endings.find((ending) => ending.endsWith('.png'));
  if (image !== undefined) {
    const shown = element('img');
    shown.src = encodeURIComponent(mesh.name + image);
    shown.alt = mesh.file;
    shown.loading = 'lazy';
    const whole = link(mesh, image, '');
    whole.append(shown);
    picture.append(whole);
  }
  files.append(...mesh.endings.map((ending) => link(mesh, ending, ending)));
  const made = element('tr');
  made.append(picture, ...cells, files);
  return made;
}
function matching() {
  const words = search.value.toLowerCase().split(/\s+/).filter((word) => word !== '');
  const of = columns[sorted].of;
  const compare = (a, b) => (of(a) === null ? 1 : 0) - (of(b) === null ? 1 : 0) ||
    (falling ? -1 : 1) * (of(a) < of(b) ? -1 : of(a) > of(b) ? 1 : 0);
  return meshes.filter((mesh) => (only.value === '' || only.value === mesh.status || (only.value === 'told' && mesh.told !== null)) &&
    words.every((word) => `${mesh.file} ${mesh.name} ${mesh.told ?? ''}`.toLowerCase().includes(word))).sort(compare);
}
function show() {
  const found = matching();
  first = Math.max(0, Math.min(first, found.length - 1));
  first -= first % kRows;
  const head = element('tr');
  head.append(element('th'), ...columns.map(({ title, number }, n) => {
    const cell = element('th', '', number ? 'number' : '');
    const press = element('button', title + (n === sorted ? (falling ? ' ▼' : ' ▲') : ''));
    press.onclick = () => {
      falling = n === sorted ? !falling : false;
      sorted = n;
      first = 0;
      show();
    };
    cell.append(press);
    return cell;
  }), element('th', 'files'));
  table.replaceChildren(head, ...found.slice(first, first + kRows).map(row));
  const last = Math.min(first + kRows, found.length);
  count.textContent = found.length === 0 ? 'none found' : `${first + 1} to ${last} of ${found.length}`;
  before.disabled = first === 0;
  after.disabled = last === found.length;
}
search.oninput = only.onchange = () => { first = 0; show(); };
before.onclick = () => { first -= kRows; show(); };
after.onclick = () => { first += kRows; show(); };
show();
</script>
)";

/// Returns the value at a path of keys, such as {"measured", "near", "rms"}. Returns null if there is none.
Json valueAt(const Json& record, std::initializer_list<const char*> keys) {
  const Json* value = &record;
  for (const char* key : keys) {
    if (!value->is_object() || !value->contains(key)) return nullptr;
    value = &(*value)[key];
  }
  return *value;
}

Json numberAt(const Json& record, std::initializer_list<const char*> keys) {
  Json value = valueAt(record, keys);
  return value.is_number() ? value : Json();
}

double sumOf(const std::vector<SetMesh>& meshes, const char* key) {
  double sum = 0;
  for (const SetMesh& mesh : meshes)
    if (const Json value = numberAt(mesh.record, {key}); !value.is_null()) sum += value.get<double>();
  return sum;
}

/// Returns the middle and the greatest of the errors near the surface, as text.
std::string errorsText(const std::vector<SetMesh>& meshes) {
  std::vector<double> errors;
  for (const SetMesh& mesh : meshes)
    if (const Json value = numberAt(mesh.record, {"measured", "near", "rms"}); !value.is_null())
      errors.push_back(value.get<double>());
  if (errors.empty()) return "not measured";
  std::ranges::sort(errors);
  return fmt::format("median {}, greatest {}", shortNumber(errors[errors.size() / 2]), shortNumber(errors.back()));
}

/// Returns what the page shows of a mesh. `told` is the mesh's error, or what its field misses.
Json shownJson(const SetMesh& mesh) {
  const Json error = valueAt(mesh.record, {"error"}), missed = valueAt(mesh.record, {"missed"});
  return {{"file", valueAt(mesh.record, {"file"})},
          {"name", mesh.name},
          {"status", statusOf(mesh.record)},
          {"leaves", numberAt(mesh.record, {"leaves"})},
          {"bytes", numberAt(mesh.record, {"file_bytes"})},
          {"rms", numberAt(mesh.record, {"measured", "near", "rms"})},
          {"max", numberAt(mesh.record, {"measured", "near", "max"})},
          {"torn", numberAt(mesh.record, {"measured", "torn_share"})},
          {"seconds", numberAt(mesh.record, {"seconds"})},
          {"told", error.is_string()    ? error
                   : missed.is_string() ? missed
                                        : Json()},
          {"endings", mesh.endings}};
}

/// Returns JSON that may stand in a <script> element: nothing in it ends the element.
std::string scriptJson(const Json& json) {
  std::string safe;
  for (const char c : jsonLine(json)) safe += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return safe;
}

}  // namespace

std::string setPage(const std::string& title, const std::vector<SetMesh>& meshes) {
  std::map<std::string, std::size_t> counts;
  Json shown = Json::array();
  for (const SetMesh& mesh : meshes) {
    ++counts[statusOf(mesh.record)];
    shown.push_back(shownJson(mesh));
  }
  std::string html = htmlHead(title, fmt::format("{} meshes", grouped(meshes.size())), kSetStyle) + "<table>\n";
  std::string choices;
  for (const auto& [status, count] : counts) {
    html += htmlFact(status, grouped(count));
    choices += fmt::format("<option value=\"{0}\">{0}</option>", render::escapedMarkup(status));
  }
  html += htmlFact("fields, all files", bytesText(sumOf(meshes, "file_bytes")));
  html += htmlFact("time of all processes", durationText(sumOf(meshes, "seconds")));
  html += htmlFact("RMS error near the surface", errorsText(meshes));
  html += fmt::format(
      "</table>\n<noscript>The table of meshes needs JavaScript.</noscript>\n<div class=\"choices\">"
      "<input id=\"search\" type=\"search\" placeholder=\"search names and errors\" aria-label=\"search\">"
      "<select id=\"only\" aria-label=\"status\"><option value=\"\">all</option>{}<option value=\"told\">with an error "
      "or a missed tolerance</option></select>"
      "<button id=\"before\">previous</button><output id=\"count\"></output><button id=\"after\">next</button></div>\n"
      "<table id=\"meshes\"></table>\n<script type=\"application/json\" id=\"data\">{}</script>\n",
      choices, scriptJson(shown));
  return html + std::string(kSetScript) + htmlFoot(versionText());
}

}  // namespace hpsdf::app
