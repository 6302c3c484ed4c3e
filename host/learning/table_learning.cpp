#include "table_learning.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "observed_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Places every press on every map of another press of its object.
std::vector<OwnPlacement> place_all(Device& device, const std::vector<Press>& presses,
                                    const std::vector<OccupancyGrid>& maps,
                                    const std::vector<OccupancyGrid>& layers,
                                    const TableLearning& how, const LearnedTable& table,
                                    const std::function<void(double)>& progress) {
  std::map<std::string, std::vector<std::size_t>> by_label;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    by_label[presses[i].label].push_back(i);
  }
  std::vector<OwnPlacement> placements;
  std::size_t done = 0;
  for (const auto& [label, own] : by_label) {
    const ContactModel contact = contact_with(how.contact, table, label);
    for (const std::size_t map : own) {
      if (own.size() > 1) {
        PressPlacer placer(device, {.map = maps[map], .layer = layers[map]}, contact, how.lattice);
        for (const std::size_t press : own) {
          if (press != map) {
            placements.push_back({press, map, placer.place(presses[press])});
          }
        }
      }
      progress(static_cast<double>(++done) / static_cast<double>(presses.size()));
    }
  }
  return placements;
}

}  // namespace

LearnedTable TableLearning::initial() const {
  LearnedTable table{.layer = layer, .level_edges = level_edges};
  table.shared = initial_table(layer, table.levels(), contact);
  return table;
}

LearnedTable table_of(const ObjectCounts& counts, const TableLearning& how) {
  LearnedTable table = how.initial();
  LevelCounts all(table.levels());
  for (const auto& [label, own] : counts) {
    all += own;
  }
  table.shared = shrunk_table(all, table.shared, how.shared_pseudo_counts);
  for (const auto& [label, own] : counts) {
    table.objects[label] = shrunk_table(own, table.shared, how.object_pseudo_counts);
  }
  return table;
}

std::vector<double> table_without(const ObjectCounts& counts, const std::string& label,
                                  const TableLearning& how) {
  ObjectCounts others = counts;
  others.erase(label);
  return table_of(others, how).shared;
}

ContactModel contact_with(const ContactModel& contact, const LearnedTable& table,
                          const std::string& label) {
  const auto own = table.objects.find(label);
  ContactModel model = contact;
  model.table = table_of(table, own == table.objects.end() ? table.shared : own->second);
  model.prior = probability_from_log_odds(ReadingLayer::beyond);
  return model;
}

PlacedPresses learn_table(Device& device, const std::vector<Press>& presses,
                          const std::vector<OccupancyGrid>& maps, const TableLearning& how,
                          const std::function<void(double)>& progress) {
  std::map<std::string, int> presses_of;
  for (const Press& press : presses) {
    ++presses_of[press.label];
  }
  if (std::ranges::none_of(presses_of, [](const auto& of) { return of.second > 1; })) {
    throw Error(Fault::input,
                fmt::format("likelihood table: {} presses of {} objects; give at least two presses "
                            "of one object",
                            presses.size(), presses_of.size()));
  }
  std::vector<OccupancyGrid> layers(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(),
                    [&](std::size_t i) { layers[i] = reading_layer(maps[i], how.layer); });
  PlacedPresses placed{.placements = {}, .table = how.initial()};
  for (int round = 0; round < how.rounds; ++round) {
    placed.placements =
        place_all(device, presses, maps, layers, how, placed.table, [&](double fraction) {
          if (progress) {
            progress((round + fraction) / how.rounds);
          }
        });
    placed.table = table_of(count_placed(placed.placements, presses, layers, how), how);
  }
  return placed;
}

ObjectCounts count_placed(std::span<const OwnPlacement> placements,
                          const std::vector<Press>& presses,
                          const std::vector<OccupancyGrid>& layers, const TableLearning& how,
                          const std::vector<bool>& counted) {
  std::vector<std::vector<const OwnPlacement*>> of_press(presses.size());
  for (const OwnPlacement& placement : placements) {
    if (counted.empty() || (counted[placement.press] && counted[placement.map])) {
      of_press[placement.press].push_back(&placement);
    }
  }
  const LearnedTable levels = how.initial();
  const ContactModel classifier = contact_with(how.contact, levels, "");
  ObjectCounts counts;
  for (std::size_t press = 0; press < presses.size(); ++press) {
    std::vector<const OwnPlacement*>& on = of_press[press];
    std::ranges::stable_sort(on, [](const OwnPlacement* a, const OwnPlacement* b) {
      return a->placement.log_likelihood > b->placement.log_likelihood;
    });
    on.resize(std::min(on.size(), how.best_maps));
    for (const OwnPlacement* placement : on) {
      counts.try_emplace(presses[press].label, levels.levels())
          .first->second.add(presses[press].touches, placement->placement.T_object_robot,
                             layers[placement->map], classifier);
    }
  }
  return counts;
}

LevelCounts count_posed(const Press& touches, const MapOptions& map_options,
                        const TableLearning& how, std::size_t folds) {
  const std::vector<Touch>& all = touches.touches;
  if (folds < 2 || all.size() < folds) {
    throw Error(Fault::input,
                fmt::format("{}: {} touches in {} folds; give at least two folds and as many "
                            "touches as folds",
                            touches.name, all.size(), folds));
  }
  const LearnedTable levels = how.initial();
  const ContactModel classifier = contact_with(how.contact, levels, "");
  std::vector<LevelCounts> of_fold(folds, LevelCounts(levels.levels()));
  tbb::parallel_for(std::size_t{0}, folds, [&](std::size_t fold) {
    std::vector<Touch> building;
    std::vector<Touch> counted;
    for (std::size_t i = 0; i < all.size(); ++i) {
      (i % folds == fold ? counted : building).push_back(all[i]);
    }
    const OccupancyGrid layer =
        reading_layer(observed_map(building, map_options, touches.label), how.layer);
    of_fold[fold].add(counted, Pose{}, layer, classifier);
  });
  LevelCounts sum(levels.levels());
  for (const LevelCounts& counts : of_fold) {
    sum += counts;
  }
  return sum;
}

}  // namespace palpate
