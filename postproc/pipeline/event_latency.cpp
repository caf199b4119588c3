#include "postproc/pipeline/event_latency.h"

#include <algorithm>

#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

const EventWords* row_of(const MachineDefinition& machine, const MachineAction& action) {
  if (action.kind != MachineAction::Kind::event) return nullptr;
  for (const auto& row : machine.process.events)
    if (row.event == action.event.name) return &row;
  return nullptr;
}

/// Where an action goes: `share` of move `move` is done before it.
struct Place {
  std::size_t move = 0;
  double share = 0.0;
  std::size_t action = 0;
};

bool stops(const MachineDefinition& machine, const MachineAction& action) {
  if (action.kind == MachineAction::Kind::dwell) return true;
  const EventWords* row = row_of(machine, action);
  return row != nullptr && (!row->on_the_fly || row->dwell > 0.0);
}

bool runs(const MachineMove& move) { return move.role == MoveRole::path && !move.rapid; }

/// The place `latency` seconds ahead of action `a`; share 0 of its own move when there is none.
Place ahead(const MachineProgram& program, const MachineDefinition& machine, std::size_t a,
            double latency) {
  const std::size_t before = program.actions[a].before;
  Place place{before, 0.0, a};
  // A stop at the same place, or at one that is passed on the way, is the earliest.
  std::size_t floor = 1;  // where the first move starts is not known
  for (std::size_t k = a; k-- > 0;)
    if (stops(machine, program.actions[k])) {
      floor = std::max(floor, program.actions[k].before);
      break;
    }
  double left = latency;
  while (place.move > floor && left > 0.0) {
    const MachineMove& move = program.moves[place.move - 1];
    if (!runs(move)) break;
    --place.move;
    if (move.duration > left) {
      place.share = 1.0 - left / move.duration;
      return place;
    }
    left -= move.duration;
  }
  return place;
}

PathPlace place_on(const ReferencePath* reference, const MachineMove& move, double share) {
  if (reference == nullptr || move.from_segment == move.segment)
    return {move.segment, move.from_share + share * (move.to_share - move.from_share)};
  return place_between(*reference, {move.from_segment, move.from_share},
                       {move.segment, move.to_share}, share);
}
void begin(MachineMove& move, const PathPlace& place) {
  move.from_segment = place.segment;
  move.from_share = place.s;
}
void end(MachineMove& move, const PathPlace& place) {
  move.segment = place.segment;
  move.to_share = place.s;
}

}  // namespace

void compensate_latency(MachineProgram& program, const MachineDefinition& machine, ToolTurn turn,
                        const ReferencePath* reference) {
  std::vector<Place> places;
  bool any = false;
  for (std::size_t a = 0; a < program.actions.size(); ++a) {
    const EventWords* row = row_of(machine, program.actions[a]);
    const double latency = row != nullptr && row->on_the_fly ? row->latency : 0.0;
    places.push_back(latency > 0.0 ? ahead(program, machine, a, latency)
                                   : Place{program.actions[a].before, 0.0, a});
    any = any || places.back().move != program.actions[a].before;
  }
  if (!any) return;
  std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.move != b.move ? a.move < b.move : a.share < b.share;
  });
  std::vector<MachineMove> moves;
  std::vector<MachineAction> actions;
  moves.reserve(program.moves.size() + places.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i <= program.moves.size(); ++i) {
    double done = 0.0;
    for (; next < places.size() && places[next].move == i; ++next) {
      const Place& place = places[next];
      if (place.share > done) {
        const MachineMove& whole = program.moves[i];
        MachineMove part = whole;
        const JointVector& from = program.moves[i - 1].to;
        part.to = from + place.share * (whole.to - from);
        if (whole.interpolation == MoveInterpolation::tool)
          part.tool = tool_motion(program.moves[i - 1].tool, whole.tool, place.share, turn,
                                  machine.tool.axis);
        begin(part, place_on(reference, whole, done));
        end(part, place_on(reference, whole, place.share));
        part.duration = (place.share - done) * whole.duration;
        part.stretch_time = whole.stretch_time - (1.0 - place.share) * whole.duration;
        moves.push_back(std::move(part));
        done = place.share;
      }
      actions.push_back(program.actions[place.action]);
      actions.back().before = moves.size();
    }
    if (i == program.moves.size()) break;
    moves.push_back(program.moves[i]);
    if (done > 0.0) {
      MachineMove& rest = moves.back();
      begin(rest, place_on(reference, program.moves[i], done));
      rest.duration *= 1.0 - done;
    }
  }
  program.moves = std::move(moves);
  program.actions = std::move(actions);
}

}  // namespace smoothpost
