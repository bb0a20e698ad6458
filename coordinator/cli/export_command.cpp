// `pvsfarm export`: a store as JSON lines, for programs in any language.
#include <CLI/CLI.hpp>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>

#include "common/base/atomic_file.hpp"
#include "common/pvs/hints_file.hpp"
#include "common/pvs/store_reader.hpp"
#include "coordinator/cli/cell_times.hpp"
#include "coordinator/cli/command.hpp"
#include "coordinator/cli/file_cell.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

struct ExportOptions {
  std::string store, output;
  bool all = false, hints = false;
};

using Sink = std::function<Status(std::string_view)>;

void append_ids(std::string& out, const VisibleSet& set) {
  out += '[';
  bool first = true;
  set.for_each([&](ObjectId id) {
    if (!first) out += ',';
    first = false;
    out += std::to_string(index_of(id));
  });
  out += ']';
}

std::string head_line(UpAxis up, const std::vector<StoreObject>& objects) {
  std::string line = R"({"format":"pvsfarm-export","version":1,"up":")";
  line += up == UpAxis::kY ? "y" : "z";
  line += R"(","objects":[)";
  for (std::size_t id = 0; id < objects.size(); ++id) {
    const StoreObject& object = objects[id];
    if (id != 0) line += ',';
    line += R"({"id":)" + std::to_string(id) + R"(,"name":)";
    append_json(line, object.name);
    line += R"(,"triangles":)" + std::to_string(object.triangle_count) + R"(,"aabb":[)";
    const Box box = file_box(up, object.box);
    append_json(line, box.lo);
    line += ',';
    append_json(line, box.hi);
    line += "]}";
  }
  return line + "]}\n";
}

std::string node_line(UpAxis up, const StoredNode& node) {
  std::string line = R"({"cell":)" + std::to_string(node.index) + R"(,"root":)" +
                     std::to_string(node.root_id) + R"(,"parent":)" + std::to_string(node.parent) +
                     R"(,"depth":)" + std::to_string(node.key.depth()) + R"(,"leaf":)" +
                     (node.leaf ? "true" : "false") + R"(,"center":)";
  const FileCell cell = file_cell(up, node.cell);
  append_json(line, cell.center);
  line += R"(,"axes":[)";
  for (int a = 0; a < 3; ++a) {
    if (a != 0) line += ',';
    append_json(line, cell.axes[a]);
  }
  line += R"(],"half":)";
  append_json(line, cell.half);
  return line;
}

// Beside `visible`, in its order: degrees of 255, and sizes (docs/store_format.md).
void append_hints(std::string& line, std::span<const std::byte> row) {
  const auto list = [&](const char* name, std::span<const std::byte> values) {
    line += std::string(",\"") + name + "\":[";
    for (std::size_t i = 0; i < values.size(); ++i)
      line += (i != 0 ? "," : "") + std::to_string(std::to_integer<unsigned>(values[i]));
    line += ']';
  };
  list("degree", row.first(row.size() / 2));
  list("size", row.subspan(row.size() / 2));
}

Status export_nodes(StoreReader& store, const ExportOptions& options, const Sink& sink) {
  const auto objects = store.objects();
  if (!objects) return objects.error();
  const auto times_ms = read_cell_times(options.store, store.node_count());
  if (!times_ms) return times_ms.error();
  std::optional<HintsReader> hints;
  if (options.hints) {
    auto read = read_hints(store);
    if (!read) return read.error();
    hints = std::move(*read);
  }
  const UpAxis up = store.header().up;
  if (Status status = sink(head_line(up, *objects)); !status) return status;
  for (std::uint32_t i = 0; i < store.node_count(); ++i) {
    const auto node = store.node(i);
    if (!node) return node.error();
    if (!node->leaf && !options.all) continue;
    const auto sets = store.sets(i);
    if (!sets) return sets.error();
    std::string line = node_line(up, *node) + R"(,"visible":)";
    append_ids(line, sets->visible);
    line += R"(,"seen":)";
    append_ids(line, sets->seen);
    line += R"(,"triangles":)" + std::to_string(triangles_of(sets->visible, *objects)) +
            R"(,"seen_triangles":)" + std::to_string(triangles_of(sets->seen, *objects)) +
            R"(,"ms":)";
    append_json(line, times_ms->at(i));
    if (hints && node->leaf) append_hints(line, hints->row(i));
    if (Status status = sink(line + "}\n"); !status) return status;
  }
  return {};
}

Status run_export(const ExportOptions& options) {
  auto store = StoreReader::open(options.store);
  if (!store) return store.error();
  if (options.output.empty())
    return export_nodes(**store, options, [](std::string_view line) -> Status {
      if (!std::cout.write(line.data(), static_cast<std::streamsize>(line.size())))
        return io_error("standard output: cannot write (disk full or closed?)");
      return {};
    });
  auto file = AtomicFile::create(options.output);
  if (!file) return file.error();
  const Status status =
      export_nodes(**store, options, [&](std::string_view line) { return (*file)->write(line); });
  return status ? (*file)->commit() : status;
}

}  // namespace

void add_export_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand("export", "a store as JSON lines");
  command->add_option("store", options->store, "the .pvs file")->required();
  command->add_option("-o,--output", options->output,
                      "a file, whole or not at all; default stdout");
  command->add_flag("--hints", options->hints,
                    "of leaves, `degree` and `size` of each visible object, from STORE.hints");
  command->add_flag("--all", options->all, "inner cells too, not only leaves");
  command->footer(
      "The first line lists the objects, each further line is a cell, in the scene file's own\n"
      "coordinates. `ms` comes from STORE.stats, which `pvsfarm bake` writes; 0 without it.\n"
      "Examples:\n"
      "  pvsfarm export city.pvs -o city.jsonl\n"
      "  pvsfarm export city.pvs | tail -n +2 | jq '.visible | length'");
  command->callback(
      [&context, options] { context.run = [options] { return run_export(*options); }; });
}

}  // namespace pvsfarm
