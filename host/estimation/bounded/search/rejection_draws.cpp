#include "estimation/bounded/search/rejection_draws.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/tile_division.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/pose_draws.hpp"

namespace palpate {

namespace {

/// Part of the belief that bins which no draw may find hold at most.
constexpr double left_out = 1e-2;
/// A tile that may hold more than this part of what is known is refined before any draw.
constexpr double most_proposed = 1.0 / 64.0;
/// Tiles of each level that are refined together, at first.
constexpr std::size_t first_refined = 64;
/// Proposals for each draw that is wanted, at first.
constexpr std::size_t first_proposals = 4;

class RejectionDraws {
 public:
  RejectionDraws(const SearchTask& task, const LargestTiles& largest)
      : task_(task), division_(task, largest), tiles_(task.space.finest_level() + 1) {
    for (const BinBox& box : division_.unseen()) {
      add_unseen(box);
    }
    const std::size_t unseen = added_.size();
    add_bins_of(division_.best_smallest(division_.best_of_largest(), 0));
    LogSum known;
    for (const EqualBins& bins : added_) {
      known.add(bins.weight + std::log(static_cast<double>(bins.box.bins())));
    }
    reference_ = known.log();
    const double all = static_cast<double>(task.options.lattice.bins()) *
                       static_cast<double>(task.space.bounds.size());
    least_bound_ = reference_ + std::log(left_out / all);
    for (const Tile& tile : division_.largest_above(least_bound_)) {
      tiles_.front().push_back({tile, weight_of(tile, 0)});
    }
    added_.resize(unseen);  // the others come again, with their tiles
    weigh_added();
    refine_heaviest();
  }

  std::vector<DrawnBin> draw(std::size_t count, Random& random) {
    std::vector<DrawnBin> draws;
    for (std::size_t proposals = first_proposals * count; draws.size() < count; proposals *= 2) {
      task_.deadline.cancel_point();
      const std::vector<DrawnBin> accepted = propose(one_in_each_part(proposals, random));
      if (accepted.size() >= count) {
        for (const double part : one_in_each_part(count, random)) {
          draws.push_back(
              accepted[static_cast<std::size_t>(part * static_cast<double>(accepted.size()))]);
        }
      }
    }
    std::ranges::sort(draws, {}, &DrawnBin::place);
    return draws;
  }

 private:
  /// A tile that can be proposed. Weights are multiples of exp(reference_).
  struct WeightedTile {
    Tile tile;
    double weight = 0.0;  ///< 0 once its parts stand in its place
  };
  /// A bin that was evaluated, or many at which every element sees the prior.
  struct EqualBins {
    BinBox box;
    double weight = 0.0;  ///< of all of them; of one, and its log, before weigh_added()
  };
  /// What a refined tile was replaced by: tiles of the next level, and bins.
  struct Parts {
    std::size_t first_tile = 0;
    std::size_t end_tile = 0;
    std::size_t first_bins = 0;
    std::size_t end_bins = 0;
  };
  /// A number below the weight of a tile of one level.
  struct Proposal {
    std::size_t tile = 0;
    double at = 0.0;
  };

  double weight_of(const Tile& tile, std::size_t level) const {
    return static_cast<double>(task_.space.bounds[tile.object].bins(level, tile)) *
           std::exp(tile.bound - reference_);
  }

  BinBox box_of(const Tile& tile, std::size_t level) const {
    return task_.space.bounds[tile.object].levels()[level].box_of(tile);
  }

  void add_unseen(const BinBox& box) {
    added_.push_back(
        {box, task_.space.log_weight[box.object] + division_.prior_log_likelihood(box.object)});
  }

  /// Evaluates the bins of smallest tiles. @returns where each tile's bins will stand
  std::vector<Parts> add_bins_of(const std::vector<Tile>& tiles) {
    std::vector<BinBox> boxes;
    std::size_t count = 0;
    for (const Tile& tile : tiles) {
      boxes.push_back(box_of(tile, task_.space.finest_level()));
      count += static_cast<std::size_t>(boxes.back().bins());
    }
    std::vector<double> values(count);
    task_.likelihood.evaluate(boxes, task_.elements, Arithmetic::float32, values);
    std::vector<Parts> parts;
    auto value = values.begin();
    for (const BinBox& box : boxes) {
      const std::size_t first = bins_.size() + added_.size();
      for (int y = 0; y < box.y_count; ++y) {
        for (int x = 0; x < box.x_count; ++x) {
          added_.push_back({{box.object, box.theta, box.y_first + y, 1, box.x_first + x, 1},
                            task_.space.log_weight[box.object] + *value++});
        }
      }
      parts.push_back({.first_bins = first, .end_bins = bins_.size() + added_.size()});
    }
    return parts;
  }

  /// Divides tiles of a level. @returns where each tile's parts stand
  std::vector<Parts> add_parts_of(const std::vector<Tile>& tiles, std::size_t level) {
    std::vector<Tile> unseen;
    const std::vector<Tile> seen = division_.parts_of(tiles, level, &unseen);
    std::vector<WeightedTile>& below = tiles_[level + 1];
    std::vector<Parts> parts;
    auto part = seen.begin();
    auto rest = unseen.begin();
    for (const Tile& tile : tiles) {
      Parts own{.first_tile = below.size(), .first_bins = bins_.size() + added_.size()};
      for (; part != seen.end() && is_part(*part, tile); ++part) {
        if (part->bound > least_bound_) {
          below.push_back({*part, weight_of(*part, level + 1)});
        }
      }
      for (; rest != unseen.end() && is_part(*rest, tile); ++rest) {
        add_unseen(box_of(*rest, level + 1));
      }
      own.end_tile = below.size();
      own.end_bins = bins_.size() + added_.size();
      parts.push_back(own);
    }
    return parts;
  }

  /// Replaces tiles of a level, sorted by place, by their parts or bins.
  std::vector<Parts> refine(const std::vector<Tile>& tiles, std::size_t level) {
    std::vector<Parts> parts =
        level == task_.space.finest_level() ? add_bins_of(tiles) : add_parts_of(tiles, level);
    weigh_added();
    return parts;
  }

  /// Gives added bins their weights.
  void weigh_added() {
    constexpr double most_nats = 100.0;  // far within what numbers hold
    double largest = reference_;
    for (const EqualBins& bins : added_) {
      largest = std::max(largest, bins.weight);
    }
    if (largest > reference_ + most_nats) {
      for (EqualBins& bins : bins_) {
        bins.weight *= std::exp(reference_ - largest);
      }
      reference_ = largest;
      for (std::size_t level = 0; level < tiles_.size(); ++level) {
        for (WeightedTile& of : tiles_[level]) {
          of.weight = of.weight > 0.0 ? weight_of(of.tile, level) : 0.0;
        }
      }
    }
    for (const EqualBins& bins : added_) {
      bins_.push_back(
          {bins.box, static_cast<double>(bins.box.bins()) * std::exp(bins.weight - reference_)});
    }
    added_.clear();
  }

  /// Refines tiles that would be proposed again and again, the heaviest first: their bins raise the
  /// mass that is known, beside which others may be light.
  void refine_heaviest() {
    bool refined = true;
    for (std::size_t most = first_refined; refined; most *= 2) {
      refined = false;
      task_.deadline.cancel_point();
      for (std::size_t level = 0; level < tiles_.size(); ++level) {
        double known = 0.0;
        for (const EqualBins& bins : bins_) {
          known += bins.weight;
        }
        std::vector<WeightedTile*> heavy;
        for (WeightedTile& of : tiles_[level]) {
          if (of.weight > most_proposed * known) {
            heavy.push_back(&of);
          }
        }
        if (heavy.size() > most) {
          std::ranges::nth_element(heavy, heavy.begin() + static_cast<std::ptrdiff_t>(most),
                                   std::greater(), &WeightedTile::weight);
          heavy.resize(most);
        }
        std::vector<Tile> tiles;
        for (WeightedTile* of : heavy) {
          tiles.push_back(of->tile);
          of->weight = 0.0;
        }
        std::ranges::sort(tiles, stands_before);
        refine(tiles, level);
        refined = refined || !tiles.empty();
      }
    }
  }

  /// One of equal bins, at this number below their weight.
  DrawnBin bin_at(const EqualBins& bins, double at) const {
    const std::int64_t count = bins.box.bins();
    const auto i = static_cast<std::int64_t>(at / bins.weight * static_cast<double>(count));
    return {bins.box.object, bins.box.bin(std::min(i, count - 1), task_.options.lattice)};
  }

  /// Proposes a bin at each of these ascending parts of all weight. @returns those accepted
  std::vector<DrawnBin> propose(const std::vector<double>& parts) {
    double total = 0.0;
    for (const EqualBins& bins : bins_) {
      total += bins.weight;
    }
    for (const std::vector<WeightedTile>& level : tiles_) {
      for (const WeightedTile& of : level) {
        total += of.weight;
      }
    }
    double reached = 0.0;
    auto next = parts.begin();
    const auto take = [&](double weight, const auto& proposed) {
      for (; next != parts.end() && *next * total < reached + weight; ++next) {
        proposed(*next * total - reached);
      }
      reached += weight;
    };
    std::vector<DrawnBin> accepted;
    for (const EqualBins& bins : bins_) {
      take(bins.weight, [&](double at) { accepted.push_back(bin_at(bins, at)); });
    }
    std::vector<std::vector<Proposal>> proposals(tiles_.size());
    for (std::size_t level = 0; level < tiles_.size(); ++level) {
      for (std::size_t i = 0; i < tiles_[level].size(); ++i) {
        take(tiles_[level][i].weight, [&](double at) { proposals[level].push_back({i, at}); });
      }
    }
    for (std::size_t level = 0; level < tiles_.size(); ++level) {
      go_on(level, proposals, accepted);
    }
    return accepted;
  }

  /// Refines the tiles that a level's proposals fell into, and lets each proposal go on to the part
  /// or the bin that it then falls into, if any.
  void go_on(std::size_t level, std::vector<std::vector<Proposal>>& proposals,
             std::vector<DrawnBin>& accepted) {
    std::vector<WeightedTile>& own = tiles_[level];
    std::vector<Proposal>& of_level = proposals[level];
    std::ranges::stable_sort(of_level, [&](const Proposal& a, const Proposal& b) {
      return stands_before(own[a.tile].tile, own[b.tile].tile);
    });
    std::vector<Tile> tiles;
    std::vector<std::size_t> tile_of;  // [proposal]
    for (const Proposal& proposal : of_level) {
      WeightedTile& of = own[proposal.tile];
      if (of.weight > 0.0) {
        tiles.push_back(of.tile);
        of.weight = 0.0;
      }
      tile_of.push_back(tiles.size() - 1);
    }
    const std::vector<Parts> refined = refine(tiles, level);
    for (std::size_t i = 0; i < of_level.size(); ++i) {
      const Parts& parts = refined[tile_of[i]];
      double at = of_level[i].at;
      // The first of some weights that the number falls into, or the last one's end.
      const auto fallen_into = [&](const auto& weighted, std::size_t first, std::size_t end) {
        for (; first < end && at >= weighted[first].weight; ++first) {
          at -= weighted[first].weight;
        }
        return first;
      };
      if (const std::size_t bins = fallen_into(bins_, parts.first_bins, parts.end_bins);
          bins < parts.end_bins) {
        accepted.push_back(bin_at(bins_[bins], at));
      } else if (parts.first_tile < parts.end_tile) {
        const std::vector<WeightedTile>& below = tiles_[level + 1];
        if (const std::size_t part = fallen_into(below, parts.first_tile, parts.end_tile);
            part < parts.end_tile) {
          proposals[level + 1].push_back({part, at});
        }
      }
    }
  }

  const SearchTask& task_;
  TileDivision division_;
  double reference_ = 0.0;                        ///< nats
  double least_bound_ = 0.0;                      ///< tiles of lower bounds are left out
  std::vector<std::vector<WeightedTile>> tiles_;  ///< [level]
  std::vector<EqualBins> bins_;
  std::vector<EqualBins> added_;  ///< that have no weights yet
};

}  // namespace

std::vector<DrawnBin> draw_bins(const SearchTask& task, const LargestTiles& largest,
                                std::size_t count, Random& random) {
  return count == 0 ? std::vector<DrawnBin>() : RejectionDraws(task, largest).draw(count, random);
}

}  // namespace palpate
