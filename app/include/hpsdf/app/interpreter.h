#pragma once
// The program's commands, scripts and pictures for a host that is no command line, such as the Python module.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/combine/expression.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field.h"
#include "hpsdf/render/image.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// An option of a command with its value, written as in a script: {"color", "degree"}, {"cracks", "true"}.
struct Option {
  std::string name;
  std::string value;
};

/// The description of an option for help texts.
struct OptionDescription {
  std::string name;
  std::string values;       ///< the accepted values, such as "a whole number from 1 to 8"
  std::string defaultText;  ///< the default as a script would write it; "" without one
  std::string help;
};

/// Returns the options of a command that `Interpreter::draw` or `Interpreter::perform` accepts, in the order of the
/// help. Throws `Error` for an unknown command.
std::vector<OptionDescription> optionsOf(std::string_view command);

/// Reads an operand of an expression of solids: a field, a mesh, a grid or a shape, by its name. Throws `Error`, and
/// `Cancelled` if `progress` says so.
Expression loadedOperand(const std::string& name, InsideTest insideTest, const Progress& progress = {});

/// A session of the program: a current field, what was computed of it, and the commands that work on it. What commands
/// print is returned, and notes are kept for `takeNotes`. Only one thread at a time may call members of an object.
///
/// All functions that run commands throw `Error` for bad input (of the kind `option` for an option that is not
/// accepted), `Failed` if the result of a command is negative, and `Cancelled` if `progress` says so.
class Interpreter {
 public:
  Interpreter();
  ~Interpreter();
  Interpreter(const Interpreter&) = delete;
  Interpreter& operator=(const Interpreter&) = delete;

  /// Makes the field the current one. `name` stands for its file in reports and messages.
  void setField(Field field, const std::string& name);
  /// Returns the current field, or nullptr if there is none. The next command may change or replace it.
  const Field* field() const;

  /// Lets commands take this mesh where they are given `name` as the name of a mesh file.
  void setMesh(const std::string& name, TriangleMesh mesh);

  /// Runs a command and returns what it prints.
  std::string perform(std::string_view command, std::span<const Option> options, const Progress& progress = {});

  /// Runs the commands of a script and returns what they print. The script is checked as a whole before its first
  /// command runs. Words $name are replaced by the values of `variables`. Messages begin with "NAME:line:column: ".
  /// If `json` is true, each command prints its report as JSON.
  std::string run(std::string_view name, std::string_view script, std::span<const Option> variables, bool json,
                  const Progress& progress = {});

  /// Draws what a command (`slice`, `render`, `probe` or `shot`) would write as a PNG file.
  render::Image draw(std::string_view command, std::span<const Option> options, const Progress& progress = {});

  /// Returns what the last command or script printed before it threw.
  std::string takeOutput();

  /// Returns the notes and warnings since the last call, one a line.
  std::string takeNotes();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hpsdf::app
