#pragma once
#include <cstdint>

#include "core/stopwatch.h"
#include "train/flow_optimiser.h"
#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// Trains a flow on examples in minibatches until the loss over the examples held out (the last rows) no longer falls.
/// The same bits for any number of threads.
class FlowTrainer {
 public:
  /// Throws ConfigError for settings or examples that nothing can be learned with.
  FlowTrainer(const CouplingFlow& flow, const TrainingSet& examples, const FlowTraining& settings, std::uint64_t seed);

  const ExampleBlocks& first_batch() const { return m_batch; }

  struct Result {
    nn::AlignedVector<float> parameters;  ///< those that were best on the examples held out
    TrainLog log;
  };
  /// From `start` on; once only. Ends with the best so far when g_interrupted is set; throws Interrupted if there is
  /// none yet.
  Result run(nn::AlignedVector<float> start, FlowOptimiser::Pass pass = {});

 private:
  void next_batch();
  std::uint32_t next_example();
  /// Copies example i to place k of `to`, with the weight given; moved by `width`, where that is not 0.
  void copy(std::size_t i, float weight, ExampleBlocks& to, std::size_t k, double width = 0);
  double held_out_loss(const nn::AlignedVector<float>& parameters) const;

  const CouplingFlow& m_flow;
  const TrainingSet& m_examples;
  FlowTraining m_settings;
  Stopwatch m_clock;
  ExampleBlocks m_batch, m_held_out;
  std::vector<float> m_y;  // of one example
  double m_mean_weight = 0, m_held_out_weight = 0;
  // Examples to train on, in an order of its own for every epoch.
  std::vector<std::uint32_t> m_order;
  std::uint64_t m_order_seed, m_epoch = 0;
  double m_jitter = 0;           // standard deviation
  std::uint64_t m_jittered = 0;  // examples that were moved so far
  std::size_t m_next = 0;
};

}  // namespace warpath
