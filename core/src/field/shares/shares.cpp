#include "field/shares/shares.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

namespace hpsdf::detail {
namespace {

Message failureMessage(const std::string& why) {
  MessageWriter writer;
  writer.flag(true);
  writer.text(why);
  return writer.take();
}

/// Returns the numbers that a message holds.
template <typename T>
std::vector<T> numbersOf(const Message& message) {
  std::vector<T> numbers;
  MessageReader(message).list(numbers);
  return numbers;
}

template <typename T>
Message messageOfNumbers(const std::vector<T>& numbers) {
  MessageWriter writer;
  writer.list(numbers);
  return writer.take();
}

/// The first place of the part of a rank.
struct Boundary {
  int rank = 0;
  MortonPlace place;
};

}  // namespace

std::vector<Message> Shares::gatherAll(Message own, const std::function<void()>& whileWaiting) {
  MessageWriter writer;
  writer.flag(false);
  Message sent = writer.take();
  sent.insert(sent.end(), own.begin(), own.end());
  std::vector<Message> received = ranks_.gatherAll(sent, whileWaiting);
  for (Message& message : received) {
    MessageReader reader(message);
    bool hasFailed = false;
    reader.flag(hasFailed);
    if (hasFailed) {
      std::string why;
      reader.text(why);
      close();
      throw SharedFailure(why);
    }
    message.erase(message.begin());
  }
  return received;
}

void Shares::fail(const std::string& why, double seconds) {
  if (!std::exchange(isOpen_, false)) return;
  const auto start = std::chrono::steady_clock::now();
  try {
    ranks_.gatherAll(failureMessage(why), [&] {
      if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) throw Cancelled();
    });
  } catch (const Cancelled&) {
    return;  // the others may have been killed
  }
}

std::vector<Message> Shares::exchange(std::vector<Message> toEach) {
  gatherAll({});  // tells whether a rank has failed
  return ranks_.exchange(std::move(toEach));
}

std::uint64_t Shares::sum(std::uint64_t value) {
  std::uint64_t sum = 0;
  for (const Message& message : gatherAll(messageOfNumbers(std::vector{value})))
    sum += numbersOf<std::uint64_t>(message).at(0);
  return sum;
}

bool Shares::areEqual(std::uint64_t value) {
  const std::vector<Message> all = gatherAll(messageOfNumbers(std::vector{value}));
  return std::ranges::all_of(all, [&](const Message& message) { return message == all.front(); });
}

void Shares::add(ExactSum& sum) {
  const auto own = sum.numbers();
  ExactSum all;
  for (const Message& message : gatherAll(messageOfNumbers(std::vector(own.begin(), own.end())))) {
    const auto numbers = numbersOf<std::int64_t>(message);
    if (numbers.size() != ExactSum::kNumbers) throw Error("a sum of another process has another size");
    all.add(ExactSum::fromNumbers(std::span(numbers).first<ExactSum::kNumbers>()));
  }
  sum = all;
}

void Shares::add(ExactTotals& totals) {
  totals.forEachSum([&](ExactSum& sum) { add(sum); });
}

double Shares::greatest(double own) {
  double greatest = own;
  for (const Message& message : gatherAll(messageOfNumbers(std::vector{own})))
    greatest = std::max(greatest, numbersOf<double>(message).at(0));
  return greatest;
}

AcrossParts Shares::across() {
  return {.add = [this](ExactSum& sum) { add(sum); }, .greatest = [this](double own) { return greatest(own); }};
}

FieldData Shares::gatheredAtFirst(FieldData&& part) {
  const auto toFirst = [&](Message&& own) {
    std::vector<Message> messages{std::size_t(count())};
    if (!isFirst()) messages.front() = std::move(own);
    return exchange(std::move(messages));
  };
  const std::vector<Message> nodes = toFirst(isFirst() ? Message{} : nodesOf(part));
  std::optional<Assembly> assembly;
  if (isFirst()) assembly.emplace(std::move(part), std::span(nodes).subspan(1));
  // The coefficients of one part after another, so that rank 0 need not hold all parts besides the field.
  for (int from = 1; from < count(); ++from) {
    const std::vector<Message> received = toFirst(rank() == from ? coefficientsOf(part) : Message{});
    if (isFirst()) assembly->add(std::uint32_t(from), received[std::size_t(from)]);
  }
  return isFirst() ? assembly->take() : FieldData{};
}

Message Shares::fromFirst(Message own) { return gatherAll(isFirst() ? std::move(own) : Message{}).front(); }

std::vector<double> Shares::weights(const BuildTree& tree, const WeightOf& weightOf) {
  double own = 0;
  for (const BuildNode& node : tree.nodes)
    if (node.firstChild == 0) own += weightOf(node);
  std::vector<double> all;
  for (const Message& message : gatherAll(messageOfNumbers(std::vector{own})))
    all.push_back(numbersOf<double>(message).at(0));
  return all;
}

void Shares::divide(const Part& part, int maxDepth, const WeightOf& weightOf, const std::vector<double>& weights) {
  const std::vector<MortonPlace> starts = boundaries(part.tree, maxDepth, weightOf, weights);
  move(part, [&](const BuildNode& node) {
    const MortonPlace place = mortonPlaceOf({node.depth, node.cellIndex}, maxDepth);
    return int(std::ranges::upper_bound(starts, place) - starts.begin());
  });
  dropEmpty(part.tree, part.deferred);
}

std::vector<MortonPlace> Shares::boundaries(const BuildTree& tree, int maxDepth, const WeightOf& weightOf,
                                            const std::vector<double>& weights) {
  const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double before = std::accumulate(weights.begin(), weights.begin() + rank(), 0.0);

  struct Weighted {
    MortonPlace place;
    double weight;
  };
  std::vector<Weighted> leaves;
  for (const BuildNode& node : tree.nodes)
    if (const double weight = node.firstChild == 0 ? weightOf(node) : 0; weight > 0)
      leaves.push_back({mortonPlaceOf({node.depth, node.cellIndex}, maxDepth), weight});
  std::ranges::sort(leaves, {}, &Weighted::place);

  // The part of a rank begins with the leaf at which the sum of the weights reaches the shares of the ranks before it.
  std::vector<Boundary> own;
  double sum = before;
  for (const Weighted& leaf : leaves) {
    const double next = sum + leaf.weight;
    for (int rank = 1; rank < count(); ++rank) {
      const double share = all * rank / count();
      if (sum < share && next >= share) own.push_back({rank, leaf.place});
    }
    sum = next;
  }
  constexpr std::uint32_t kEnd = 0xffffffffu;  // behind all cells, except where the grid ends just there
  std::vector<MortonPlace> starts(std::size_t(count()) - 1, MortonPlace{{kEnd, kEnd, kEnd}});
  for (const Message& message : gatherAll(messageOfNumbers(own)))
    for (const Boundary& boundary : numbersOf<Boundary>(message)) starts.at(boundary.rank - 1) = boundary.place;
  for (std::size_t i = starts.size(); i-- > 1;) starts[i - 1] = std::min(starts[i - 1], starts[i]);
  return starts;
}

void Shares::gatherAtFirst(const Part& part) {
  move(part, [](const BuildNode&) { return 0; });
  if (!isFirst()) dropEmpty(part.tree, part.deferred);
}

void Shares::move(const Part& part, const std::function<int(const BuildNode&)>& rankOf) {
  std::vector<MessageWriter> writers{std::size_t(count())};
  int to = 0;
  takeOut(
      part.tree, part.deferred, [&](const BuildNode& node) { return (to = rankOf(node)) != rank(); },
      [&](TreePart&& cell) { write(writers.at(std::size_t(to)), cell); });
  std::vector<Message> messages;
  for (MessageWriter& writer : writers) messages.push_back(writer.take());
  for (const Message& message : exchange(std::move(messages))) {
    MessageReader reader(message);
    while (!reader.isAtEnd()) putIn(part.tree, part.deferred, readPart(reader));
  }
}

}  // namespace hpsdf::detail
