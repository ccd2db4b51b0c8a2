#include "widgets/file_dialog.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "hpsdf/detail/text.h"
#include "widgets/ui.h"

namespace hpsdf::app {
namespace {

namespace fs = std::filesystem;

constexpr double kDialogWidth = 560, kDialogHeight = 460, kDialogMargin = 16;  // greatest size of the dialog, points

bool isFolder(const std::string& path) {
  std::error_code unknown;
  return fs::is_directory(path, unknown);
}

bool exists(const std::string& path) {
  std::error_code unknown;
  return fs::exists(path, unknown);
}

}  // namespace

void FileDialog::ask(FileQuestion question) {
  question_ = std::move(question);
  name_ = question_->name;
  ending_ = lowerExtension(name_);
  objection_ = {};
  enter(isFolder(lastFolder_) ? lastFolder_ : "");
}

std::optional<std::string> FileDialog::chosen(const std::string& id) {
  if (answer_.first != id) return std::nullopt;
  return std::exchange(answer_, {}).second;
}

std::string FileDialog::pathOf(const std::string& name) const {
  return (fs::path(folder_) / name).lexically_normal().string();
}

/// Reads the folder: its folders first, then the files that the question accepts, both in alphabetical order. Hidden
/// files are left out.
void FileDialog::list() {
  entries_.clear();
  selected_.reset();
  problem_.clear();
  std::vector<Entry> files;
  try {
    for (const auto& file : fs::directory_iterator(folder_.empty() ? "." : folder_)) {
      const std::string name = file.path().filename().string();
      if (name.starts_with('.')) continue;
      const std::string path = pathOf(name);
      if (isFolder(path))
        entries_.push_back({name + "/", path, true});
      else if (question_->accepts(path))
        files.push_back({name, path});
    }
  } catch (const fs::filesystem_error& error) {
    problem_ = error.code().message();
  }
  std::ranges::sort(entries_, {}, &Entry::label);
  std::ranges::sort(files, {}, &Entry::label);
  entries_.insert(entries_.end(), files.begin(), files.end());
  for (std::size_t i = 0; i < question_->suggested.size(); ++i)
    entries_.insert(entries_.begin() + std::ptrdiff_t(i), {question_->suggested[i], question_->suggested[i]});
}

void FileDialog::enter(const std::string& folder) {
  folder_ = folder;
  if (!writes()) name_.clear();
  list();
  focusesName_ = true;
}

void FileDialog::select(std::size_t entry) {
  selected_ = entry;
  if (!entries_[entry].isFolder) name_ = entries_[entry].label;
  focusesName_ = true;
}

void FileDialog::moveSelection(int by) {
  if (entries_.empty()) return;
  const int last = int(entries_.size()) - 1;
  const int from = selected_ ? int(*selected_) : by > 0 ? -1 : last + 1;
  select(std::size_t(std::clamp(from + by, 0, last)));
  showsSelected_ = true;
}

/// Opens the folder, or answers with the file, of this path.
void FileDialog::take(const std::string& path) {
  if (isFolder(path)) {
    question_->suggested.clear();  // they stand above the first folder only
    return enter(path);
  }
  if (const std::string objection = objectionTo(path); !objection.empty()) {
    objection_ = {path, objection};
    focusesName_ = true;
    return;
  }
  answer_ = {question_->id, path};
  lastFolder_ = fs::path(path).parent_path().string();
  close();
}

/// Returns why a file is not written, or not without being asked for twice; otherwise "".
std::string FileDialog::objectionTo(const std::string& file) const {
  if (!writes()) return "";
  if (!question_->accepts(file))
    return fmt::format("no file with the ending {} can be written here: choose one of the endings above",
                       fs::path(file).extension().string());
  if (!exists(file) || isObjectedTo(file)) return "";
  return fmt::format("{} exists: press Enter or \"replace\" to overwrite it", fs::path(file).filename().string());
}

void FileDialog::takeChosen() {
  if (selected_) return take(entries_[*selected_].path);
  if (name_.empty()) return;
  const fs::path named(name_);
  if (writes() && !isFolder(pathOf(name_)) && named.has_filename() && !named.has_extension()) name_ += ending_;
  take(pathOf(name_));
}

void FileDialog::close() {
  question_.reset();
  ImGui::ClearActiveID();  // the keyboard is free again at once
}

void FileDialog::drawEntries(Ui& ui) {
  if (!problem_.empty()) ui.text(problem_);
  if (problem_.empty() && entries_.empty() && !writes()) ui.text("there is nothing here that can be opened", true);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry entry = entries_[i];
    const bool isSelected = selected_ == i;
    if (i == question_->suggested.size() && i > 0) ImGui::Separator();
    ui.help(entry.isFolder ? "List this folder." : "Choose this file; a second click takes it.");
    if (ui.item("files/entry/" + entry.label, entry.label.c_str(), isSelected)) {
      if (isSelected || entry.isFolder) return take(entry.path);
      select(i);
    }
    if (isSelected && showsSelected_) ImGui::SetScrollHereY();
  }
  showsSelected_ = false;
}

/// Draws a button for each kind of file, which gives the name the ending of the kind.
void FileDialog::drawEndings(Ui& ui) {
  const std::string typed = lowerExtension(name_), now = typed.empty() ? ending_ : typed;
  for (const auto& [name, ending, help] : question_->endings) {
    ui.help(help);
    if (ui.button("files/as-" + name, fmt::format("{} {}", name, ending).c_str(), now == ending)) {
      name_ = fs::path(name_).replace_extension(ending).string();
      ending_ = ending;
      focusesName_ = true;
    }
    ImGui::SameLine(0, 4);
  }
  ImGui::NewLine();
}

void FileDialog::drawContents(Ui& ui) {
  const std::string folder = fs::absolute(folder_.empty() ? "." : folder_).lexically_normal().string();
  ui.text(question_->title);
  ui.help("List the folder that holds this one.");
  const bool goesUp = ui.button("files/up", "up");
  ImGui::SameLine();
  ui.text(fittingEnd(folder, ImGui::GetContentRegionAvail().x), true);
  if (writes()) drawEndings(ui);
  const bool objects = isObjectedTo(pathOf(name_));
  ui.list("entries", ImGui::GetContentRegionAvail().y - (objects ? 3 : 2) * ImGui::GetFrameHeightWithSpacing(),
          [&] { drawEntries(ui); });
  if (!isOpen()) return;  // a click has chosen an entry
  const std::string shown = name_;
  ui.help("Name of the file, or of a folder to list.");
  ui.entry("files/name", name_, std::exchange(focusesName_, false));
  if (name_ != shown) selected_.reset();
  if (objects) ui.problem(objection_.second);
  const bool replaces = objects && question_->accepts(pathOf(name_));
  ui.help(writes() ? "Write the file of this name." : "Open the file of this name.");
  const bool isDone = ui.button("files/choose", replaces ? "replace" : writes() ? "save" : "open");
  ImGui::SameLine();
  ui.help("Close this dialog. Key: Escape");
  if (ui.button("files/cancel", "cancel")) return close();
  if (goesUp) return take(fs::path(folder + "/..").lexically_normal().string());
  if (isDone) takeChosen();
}

void FileDialog::draw(Ui& ui, double width, double height) {
  if (!isOpen()) return;
  const double w = std::min(kDialogWidth, width - kDialogMargin), h = std::min(kDialogHeight, height - kDialogMargin);
  const double x = std::floor((width - w) / 2), y = std::floor((height - h) / 2);
  const UiRect box{x, y, x + w, y + h};
  const Input* const event = ui.event();
  const auto isKey = [&](Key key) { return event != nullptr && event->kind == Input::Kind::key && event->key == key; };
  if (isKey(Key::down)) moveSelection(1);
  if (isKey(Key::up)) moveSelection(-1);
  ui.overlay("files", box, [&] { drawContents(ui); });
  const auto [px, py] = ui.pointerInPoints();
  const bool isPressBeside = event != nullptr && event->kind == Input::Kind::press && !box.contains(px, py);
  if (!isOpen()) return;
  if (isPressBeside || isKey(Key::escape)) return close();
  const bool isNamed = ui.focus().empty() || ui.focus() == "files/name";  // other controls take the key themselves
  if (isKey(Key::enter) && isNamed) takeChosen();
}

}  // namespace hpsdf::app
