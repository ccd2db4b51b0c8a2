#include "program.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "commands/commands.h"
#include "console/console.h"
#include "console/error_text.h"
#include "console/interrupt.h"
#include "console/version.h"
#include "construction/file_kind.h"
#include "construction/surface.h"
#include "hpsdf/error.h"
#include "language/help.h"
#include "ranks/process_group.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

bool asksForAllHelp(const std::string& word) { return word == "--help-all"; }
bool asksForHelp(const std::string& word) { return word == "--help" || word == "-h" || asksForAllHelp(word); }

/// Returns the words of the command line, with the command `view` before the name of a field or a mesh that stands in
/// place of a command. Throws `Error` if there is no file of this name, or if the word is neither a command nor a file
/// that the program opens.
std::vector<std::string> withCommand(std::span<const std::string> words, const Registry& registry) {
  std::vector<std::string> all(words.begin(), words.end());
  const bool isCommand = std::ranges::find(registry.commands(), words[0], &Command::name) != registry.commands().end();
  if (isCommand) return all;
  if (kindOfFile(words[0]) == FileKind::unknown) {
    std::error_code missing;
    if (std::filesystem::is_regular_file(words[0], missing)) throw unknownKind(words[0]);
    return all;
  }
  if (!isShape(words[0]) && !std::filesystem::exists(words[0]))
    throw Error(fmt::format("{}: no such file, and no command either; check the path", words[0]));
  all.insert(all.begin(), "view");
  return all;
}

void execute(std::span<const std::string> given, const Registry& registry, const Console& console) {
  if (given.empty()) throw Error("expected a command; 'hpsdf --help' lists them");
  if (given[0] == "--version") {
    console.out << versionText() << "\n";
    return;
  }
  if (asksForHelp(given[0])) {
    console.out << overviewHelp(registry);
    return;
  }
  const std::vector<std::string> words = withCommand(given, registry);
  const Command& command = registry.command(words[0]);
  if (std::ranges::any_of(words, asksForHelp)) {
    console.out << commandHelp(command,
                               std::ranges::any_of(words, asksForAllHelp) ? HelpDetail::all : HelpDetail::common);
    return;
  }
  if (command.scriptOnly)
    throw Error(fmt::format("'{}' is a command of scripts: hpsdf run -e '{} …'", command.name, command.name));
  if (console.group != nullptr && command.name != "build")
    throw Error(fmt::format("several processes build one field together: start '{}' without mpirun", command.name));
  std::vector<Word> arguments;
  for (const std::string& word : std::span(words).subspan(1)) arguments.push_back({.text = word});
  Session session(registry, console);
  const Arguments parsed = parseArguments(command, arguments, Origin::commandLine);
  perform(command, session, parsed);
  requireWritten(console.out.flush(), outputFiles(command, parsed));  // errors of buffered output appear only here
}

/// Writes the message of an error, and keeps it in `why`.
int fail(const Console& console, const std::string& message, int status, std::string& why) {
  why = message;
  console.err << "hpsdf: error: " << printable(message) << std::endl;
  return status;
}

/// Returns the exit status of cancelled work: that of the signal that cancelled it. Work that something else cancelled
/// ends as after Ctrl-C.
int cancelledStatus() {
  const int signal = InterruptGuard::signal();
  return signal == 0 ? kExitCancelled : kExitSignal + signal;
}

}  // namespace

/// Runs the program. Sets `why` to the message of an error.
static int runAlone(std::span<const std::string> words, const Console& console, std::string& why) {
  try {
    const Registry registry = makeRegistry();
    execute(words, registry, console);
    requireWritten(console.out.flush());  // for help and version
    return kExitDone;
  } catch (const CancelledPartway& cancelled) {
    console.err << "hpsdf: cancelled; " << printable(cancelled.kept()) << std::endl;
    return cancelledStatus();
  } catch (const Cancelled&) {
    console.err << "hpsdf: cancelled; nothing is half-written" << std::endl;
    return cancelledStatus();
  } catch (const ReaderGone&) {
    return kExitReaderGone;
  } catch (const PartDone&) {
    return kExitDone;
  } catch (const Failed& failed) {
    return fail(console, failed.what(), failed.status(), why);
  } catch (const std::exception& error) {
    return fail(console, errorText(error), kExitBadInput, why);
  }
}

int runProgram(std::span<const std::string> words, const Console& console) {
  std::string why = "cancelled";
  const int status = runAlone(words, console, why);
  if (status != kExitDone && console.group != nullptr && !console.group->hasBegun)
    failBefore(*console.group->ranks, fmt::format("rank {}: {}", console.group->ranks->rank(), why));
  // mpirun would end the other processes at once if one that is not the first failed.
  return console.group != nullptr && !console.group->isFirst() ? kExitDone : status;
}

}  // namespace hpsdf::app
