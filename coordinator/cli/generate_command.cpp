// `pvsfarm generate SCENE`: a parametric test scene, its cells and its tags.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>

#include "coordinator/cli/command.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/placement.hpp"
#include "coordinator/generate/write_scene.hpp"

namespace pvsfarm {
namespace {

Status write_and_report(Result<GeneratedScene> scene, const Placement& placement,
                        const std::string& path) {
  if (!scene) return scene.error();
  if (Status placed = place(*scene, placement); !placed) return placed;
  if (Status written = write_scene(*scene, path); !written) return written;
  std::uint64_t triangles = 0;
  for (const SourceObject& object : scene->source.objects) triangles += object.triangles.size();
  std::cout << path << ": " << scene->source.objects.size() << " objects, " << triangles
            << " triangles, " << scene->cells.size() << " cells\n";
  return {};
}

// Declares `generate NAME` with the options all scenes share; the caller adds its own to what is
// returned, bound to the request.
template <class Request>
struct SceneOptions {
  Request request;
  Placement placement;
  std::string output;
};

template <class Request>
struct SceneCommand {
  CLI::App* app;
  std::shared_ptr<SceneOptions<Request>> options;
};

template <class Request>
SceneCommand<Request> add_scene(CLI::App& generate, CommandContext& context, const char* name,
                                const char* summary,
                                Result<GeneratedScene> (*make)(const Request&)) {
  auto options = std::make_shared<SceneOptions<Request>>();
  CLI::App* app = generate.add_subcommand(name, summary);
  app->add_option("-o,--output", options->output, "the scene file, NAME.obj or NAME.glb")
      ->required();
  app->add_option("--seed", options->request.seed, "of the random numbers")->capture_default_str();
  app->add_option("--cell-size", options->request.cell_size, "longest side of a cell, in metres")
      ->capture_default_str();
  app->add_option("--rotate", options->placement.rotate_deg,
                  "the whole scene, cells and all, about z; in degrees")
      ->capture_default_str();
  app->add_option_function<std::pair<double, double>>(
         "--move",
         [options](const std::pair<double, double>& by) {
           options->placement.move_m = {by.first, by.second};
         },
         "the whole scene, in metres along x and y, once it is turned")
      ->type_name("X Y");
  app->callback([&context, options, make] {
    context.run = [options, make] {
      return write_and_report(make(options->request), options->placement, options->output);
    };
  });
  return {app, options};
}

// What makes a city large: Durand's districts, with detail and moving cars.
void add_city_detail(CLI::App& city, CityRequest& request) {
  city.add_option("--districts", request.districts,
                  "so many such districts in one city; cells only in the middle one")
      ->capture_default_str();
  city.add_option("--lanes", request.lanes,
                  "cells along the streets, so many abreast; 0: square cells")
      ->capture_default_str();
  city.add_option("--cars", request.cars, "in all; default: 40 a block");
  city.add_option("--building-triangles", request.building_triangles,
                  "of a building: 12, and 12 for each ledge on its fronts")
      ->capture_default_str();
  city.add_option("--car-triangles", request.car_triangles,
                  "of a car: 24, or a multiple of 4 from 200 up, with wheels")
      ->capture_default_str();
  city.add_flag("--moving-cars", request.moving_cars, "tag the cars as dynamic: they never hide");
}

void add_cities(CLI::App& generate, CommandContext& context) {
  const auto city =
      add_scene<CityRequest>(generate, context, "city",
                             "blocks of box buildings, streets with parked cars", generate_city);
  city.app->add_option("--blocks", city.options->request.blocks, "N: N x N blocks")
      ->capture_default_str();
  add_city_detail(*city.app, city.options->request);
  const auto closed = add_scene<CityRequest>(generate, context, "closed-city",
                                             "a city where one sees along one's own street only",
                                             generate_closed_city);
  closed.app->add_option("--blocks", closed.options->request.blocks, "N: N x N blocks, from 2 up")
      ->capture_default_str();
}

void add_others(CLI::App& generate, CommandContext& context) {
  const auto forest = add_scene<ForestRequest>(
      generate, context, "forest", "trees of leaf triangles, with rides between", generate_forest);
  forest.app->add_option("--trees", forest.options->request.trees)->capture_default_str();
  forest.app->add_option("--leaves", forest.options->request.leaves, "triangles of a tree's crown")
      ->capture_default_str();
  forest.app->add_option("--glades", forest.options->request.glades,
                         "N: a thicket without rides, with N glades of a cell each");
  forest.app
      ->add_option("--leaf-size", forest.options->request.leaf_size,
                   "of a thicket, half a leaf's width in metres")
      ->capture_default_str();
  const auto maze = add_scene<MazeRequest>(generate, context, "maze",
                                           "a maze of wall boxes without a roof", generate_maze);
  maze.app->add_option("--size", maze.options->request.size, "N: N x N places")
      ->capture_default_str();
  const auto terrain = add_scene<TerrainRequest>(
      generate, context, "terrain", "hills cut into tiles, with houses", generate_terrain);
  terrain.app->add_option("--tiles", terrain.options->request.tiles, "N: N x N tiles of 64 m")
      ->capture_default_str();
  terrain.app->add_option("--houses", terrain.options->request.houses_per_tile, "of a tile, 0 to 4")
      ->capture_default_str();
  const auto rooms =
      add_scene<RoomsRequest>(generate, context, "rooms",
                              "one floor of rooms with doors, windows, furniture", generate_rooms);
  rooms.app->add_option("--rooms", rooms.options->request.rooms, "N: N x N rooms")
      ->capture_default_str();
}

}  // namespace

void add_generate_command(CLI::App& app, CommandContext& context) {
  CLI::App* generate =
      app.add_subcommand("generate", "a test scene, seeded, with its cells and tags");
  generate->require_subcommand(1);
  generate->footer(
      "Beside NAME.obj or NAME.glb stand NAME.cells.json and NAME.tags.json. The same command "
      "makes\n"
      "the same bytes on every machine.\n"
      "Examples:\n"
      "  pvsfarm generate city --blocks 20 -o city.obj\n"
      "  pvsfarm generate city --blocks 10 --districts 12 --building-triangles 96 --cars 3000 "
      "\\\n    --car-triangles 1400 --moving-cars --lanes 2 --cell-size 20.2 -o durand.glb\n"
      "  pvsfarm generate forest --trees 500 --leaves 1000 --seed 7 -o forest.glb\n"
      "  pvsfarm generate city --blocks 10 --rotate 30 --move 450000 5400000 -o askew.obj\n"
      "  pvsfarm generate rooms --rooms 6 --cell-size 1 -o rooms.obj");
  add_cities(*generate, context);
  add_others(*generate, context);
}

}  // namespace pvsfarm
