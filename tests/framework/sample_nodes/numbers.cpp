// SPDX-License-Identifier: Apache-2.0
// Nodes on plain numbers (metrics with one item), by which the tests see what the runtime does.
#include <chrono>
#include <thread>

#include <marrow/plugin.hpp>

namespace numbers {
/// A function on an edge: adds a number to another.
class Adder {
 public:
  explicit Adder(const marrow::Metrics& amount) : amount_(amount) {}
  double operator()(double x) const { return x + amount_.items[0].value; }  // refers to the node's input

 private:
  const marrow::Metrics& amount_;
};
}  // namespace numbers
MARROW_FUNCTION_TYPE(numbers::Adder, "adder", 1)

namespace {
using marrow::List;
using marrow::Metrics;

Metrics number(double value) { return {{{"value", value, ""}}}; }
double value_of(const Metrics& metrics) { return metrics.items.at(0).value; }

struct ConstantOptions {
  double value = 1;
  int count = 0;
  bool flag = false;
  std::string word = "one";
  std::vector<double> numbers{1, 2};
  Eigen::Vector3d point{0, 0, 0};
  std::filesystem::path path;
};
Metrics constant(const ConstantOptions& options) { return number(options.value); }

struct Sides {
  Metrics left, right;
  List<Metrics> both;
  std::optional<Metrics> maybe;
};
struct SidesOptions {
  std::vector<std::string> names{"a", "b"};
  bool with_maybe = false;
};
Sides sides(const SidesOptions& options) {
  Sides result{number(1), number(2), {}, {}};
  for (std::size_t i = 0; i < options.names.size(); ++i)
    result.both.add(options.names[i], number(10.0 * double(i + 1)));
  if (options.with_maybe) result.maybe = number(5);
  return result;
}
List<Metrics> letters() {
  List<Metrics> list;
  list.add("x", number(100));
  list.add("y", number(200));
  list.add("z", number(300));
  return list;
}
Metrics add(const Metrics& a, const Metrics* b) { return number(value_of(a) + (b ? value_of(*b) : 0)); }
Metrics sum(const List<Metrics>& items) {
  double total = 0;
  for (const Metrics& item : items) total += value_of(item);
  return number(total);
}
Metrics fail_above(const Metrics& a, const ConstantOptions& options) {
  if (value_of(a) > options.value) throw marrow::Error("the number is too large; give a smaller one");
  return a;
}
Metrics fail_applied(const numbers::Adder& adder, const Metrics& to, const ConstantOptions& options) {
  const double result = adder(value_of(to));
  if (result > options.value) throw marrow::Error("the function gave " + std::to_string(int(result)));
  return number(result);
}
Metrics fail_drawn(marrow::Context& context) {
  throw marrow::Error("it drew " + std::to_string(context.seed() % 1000003));
}
Metrics draw(marrow::Context& context) { return number(double(context.seed() % 1000003)); }
Metrics work(const Metrics* after, const ConstantOptions& options, marrow::Context& context) {
  const auto start = std::chrono::steady_clock::now();
  double spent = 0, x = 0;
  while ((spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()) < options.value) {
    for (int i = 0; i < 100000; ++i) x += 1e-9 * i;
    context.progress(spent / options.value, "working");
    context.check_cancelled();
  }
  return number((after ? value_of(*after) : 0) + (x > 0));
}
std::shared_ptr<const numbers::Adder> adder(const Metrics& amount) { return std::make_shared<numbers::Adder>(amount); }
std::shared_ptr<const numbers::Adder> failing_adder(const Metrics&) { throw marrow::Error("it cannot add"); }
Metrics warn(marrow::Context& context) {
  context.warn("mind the gap");
  return number(1);
}
Metrics say(marrow::Context& context) {
  context.debug("a trifle");
  context.info("a word");
  return number(1);
}
Metrics apply(const numbers::Adder& adder, const Metrics& to) { return number(adder(value_of(to))); }
Metrics any(const List<Metrics>* items, const numbers::Adder* adder) {
  const double total = items ? value_of(sum(*items)) : 0;
  return number(adder ? (*adder)(total) : total);
}
Metrics judge(const Metrics& of, const marrow::Truth*) { return of; }
marrow::Truth truth() { return {}; }
struct DisplacedOptions {
  std::array<double, 3> rotation_deg{}, translation_mm{};
  double distance_mm = 0;
};
marrow::Stop stop_above(const Metrics& a, const ConstantOptions& options) {
  return {value_of(a) > options.value, "it is above " + std::to_string(int(options.value))};
}
Metrics displaced(const DisplacedOptions& options) { return number(options.translation_mm[0]); }
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.constant", constant)
      .summary("A number")
      .out("number", "the number")
      .option("value", &ConstantOptions::value, "the number", marrow::at_least(-1000), marrow::at_most(1000))
      .option("count", &ConstantOptions::count, "an integer", marrow::at_least(0))
      .option("flag", &ConstantOptions::flag, "true or false")
      .option("word", &ConstantOptions::word, "a word", marrow::one_of({"one", "two", "three"}))
      .option("numbers", &ConstantOptions::numbers, "numbers")
      .option("point", &ConstantOptions::point, "a point")
      .option("path", &ConstantOptions::path, "a file that counts by its content");
  plugin.node("test.sides", sides)
      .summary("Several outputs")
      .out("left", &Sides::left, "1")
      .out("right", &Sides::right, "2")
      .out("both", &Sides::both, "10, 20, ...", marrow::over("side"))
      .out("maybe", &Sides::maybe, "5 or nothing")
      .option("names", &SidesOptions::names, "names along the axis")
      .option("with_maybe", &SidesOptions::with_maybe, "make 'maybe'");
  plugin.node("test.letters", letters).summary("A list").out("letters", "100, 200, 300", marrow::over("letter"));
  plugin.node("test.add", add).summary("Adds").in("a", "first").in("b", "second").out("sum", "a + b");
  plugin.node("test.sum", sum)
      .summary("Adds a list")
      .in("items", "numbers", marrow::over("side"))
      .out("sum", "their sum");
  plugin.node("test.fail_above", fail_above)
      .summary("Fails")
      .in("a", "number")
      .out("number", "the same")
      .option("value", &ConstantOptions::value, "largest number that passes");
  plugin.node("test.fail_applied", fail_applied)
      .summary("Fails if a function gives too much")
      .in("adder", "function")
      .in("to", "number")
      .out("number", "result")
      .option("value", &ConstantOptions::value, "largest result that passes");
  plugin.node("test.fail_drawn", fail_drawn).summary("Fails and says its seed").random().out("number", "none");
  plugin.node("test.draw", draw).summary("Random").random().out("number", "from the seed");
  plugin.node("test.work", work)
      .summary("Keeps a core busy")
      .in("after", "waits for it")
      .out("number", "1")
      .option("value", &ConstantOptions::value, "seconds")
      .option("path", &ConstantOptions::path, "a file that counts by its content");
  plugin.node("test.adder", adder).summary("A function").in("amount", "what it adds").out("adder", "adds");
  plugin.node("test.failing_adder", failing_adder).summary("Fails").in("amount", "anything").out("adder", "none");
  plugin.node("test.warn", warn).summary("Warns").out("number", "1");
  plugin.node("test.say", say).summary("Says something at two levels").out("number", "1");
  plugin.node("test.apply", apply)
      .summary("Calls a function")
      .in("adder", "function")
      .in("to", "number")
      .out("number", "result");
  plugin.node("test.any", any)
      .summary("Adds a list and applies a function, where they are there")
      .in("items", "numbers", marrow::over("side"))
      .in("adder", "function")
      .out("number", "result")
      .relation(marrow::at_least_one({"in.items", "in.adder"}));
  plugin.node("test.displaced", displaced)
      .summary("Takes a displacement")
      .out("number", "its first part")
      .option("rotation_deg", &DisplacedOptions::rotation_deg, "rotation")
      .option("translation_mm", &DisplacedOptions::translation_mm, "translation")
      .option("distance_mm", &DisplacedOptions::distance_mm, "distance");
  plugin.node("test.stop_above", stop_above)
      .summary("Ends a loop")
      .in("a", "number")
      .out("stop", "whether it is above the value")
      .option("value", &ConstantOptions::value, "largest number that does not stop");
  plugin.node("test.truth", truth).summary("The truth").out("truth", "the truth");
  plugin.kind("judge").summary("may see the truth").sees_truth();
  plugin.node("judge.test", judge)
      .summary("Sees the truth")
      .in("of", "number")
      .in("truth", "truth")
      .out("number", "the same");
}
