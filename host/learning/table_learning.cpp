#include "table_learning.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "host_progress.hpp"
#include "observed_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Places every press on every map of another press of its object. Takes all host threads.
std::vector<OwnPlacement> place_all(const std::vector<Press>& presses,
                                    const std::vector<OccupancyGrid>& maps,
                                    const std::vector<OccupancyGrid>& layers,
                                    const TableLearning& how, const LearnedTable& table,
                                    HostProgress& progress) {
  std::map<std::string, std::vector<std::size_t>> by_label;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    by_label[presses[i].label].push_back(i);
  }
  std::vector<std::vector<OwnPlacement>> on_map(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t map) {
    const std::string& label = presses[map].label;
    const Hypothesis hypothesis{.map = maps[map], .layer = layers[map]};
    PressPlacer placer(hypothesis, contact_with(how.contact, table, label), how.lattice);
    for (const std::size_t press : by_label.at(label)) {
      if (press != map) {
        on_map[map].push_back({press, map, placer.place(presses[press])});
      }
    }
    progress.add();
  });
  std::vector<OwnPlacement> placements;
  for (const std::vector<OwnPlacement>& own : on_map) {
    placements.insert(placements.end(), own.begin(), own.end());
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

PlacedPresses learn_table(const std::vector<Press>& presses, const std::vector<OccupancyGrid>& maps,
                          const TableLearning& how, const std::function<void(double)>& progress) {
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
  HostProgress counter(maps.size() * static_cast<std::size_t>(how.rounds), progress);
  for (int round = 0; round < how.rounds; ++round) {
    placed.placements = place_all(presses, maps, layers, how, placed.table, counter);
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
