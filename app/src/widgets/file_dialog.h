#pragma once
// A dialog over the frame in which the user chooses a file to open, or a name for a file to write.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hpsdf::app {

class Ui;

/// A kind of file that can be written.
struct FileEnding {
  std::string name;    ///< such as "picture"
  std::string ending;  ///< such as ".png"
  std::string help;    ///< tells more about it
};

/// A question for a file.
struct FileQuestion {
  std::string id;                                        ///< names the answer, see `FileDialog::chosen`
  std::string title;                                     ///< such as "Open a mesh or a field"
  std::function<bool(const std::string& file)> accepts;  ///< tells which files are listed and can be written
  std::vector<std::string> suggested = {};               ///< files that are listed first, such as recent ones
  std::vector<FileEnding> endings = {};                  ///< the kinds of a file to be written; empty to open a file
  std::string name = {};                                 ///< proposed name of a file to be written
};

/// The dialog that asks for a file. It lists folders and files; arrow keys choose one of them, a name can be typed.
class FileDialog {
 public:
  /// Opens the dialog. It begins in the folder of the file that was chosen last.
  void ask(FileQuestion question);
  bool isOpen() const { return question_.has_value(); }
  /// Returns the file that was chosen for the question of this id, once. Its path is relative to the current folder if
  /// possible.
  std::optional<std::string> chosen(const std::string& id);

  /// If the dialog is open, handles the event of the frame and draws the dialog. Must be called within `Ui::frame`,
  /// after all other widgets, which should be frozen. `width` and `height` are the size of the frame in points.
  void draw(Ui& ui, double width, double height);

 private:
  struct Entry {
    std::string label;
    std::string path;
    bool isFolder = false;
  };
  void list();
  void enter(const std::string& folder);
  void select(std::size_t entry);
  void moveSelection(int by);
  void drawContents(Ui& ui);
  void drawEntries(Ui& ui);
  void drawEndings(Ui& ui);
  void take(const std::string& path);
  void takeChosen();
  std::string objectionTo(const std::string& file) const;
  bool isObjectedTo(const std::string& file) const { return !objection_.second.empty() && objection_.first == file; }
  void close();
  std::string pathOf(const std::string& name) const;
  bool writes() const { return !question_->endings.empty(); }

  std::optional<FileQuestion> question_;
  std::string lastFolder_;  ///< folder of the file that was chosen last; "" for the current folder
  std::string folder_;      ///< folder that is listed
  std::vector<Entry> entries_;
  std::string problem_;  ///< why the folder cannot be read, or ""
  std::optional<std::size_t> selected_;
  bool showsSelected_ = false;                     ///< the selected entry is to be scrolled into sight
  std::string name_;                               ///< text of the name's field
  std::string ending_;                             ///< ending that a name without one gets
  std::pair<std::string, std::string> objection_;  ///< a file that was not written at once, and why
  bool focusesName_ = false;                       ///< the keyboard is to be given to the name's field
  std::pair<std::string, std::string> answer_;     ///< id of a question, and the file that was chosen for it
};

}  // namespace hpsdf::app
