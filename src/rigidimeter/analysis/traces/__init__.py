"""What pages and figures show of the samples of recordings: traces, examples, spectra.

Everything here takes epochs and what was estimated from them, whatever is concluded.
"""

from rigidimeter.analysis.traces.examples import (
    Prepared,
    analysed_epoch,
    drawable_perturbation,
    perturbed_epoch,
    prepared_epochs,
    representative_fits,
    representative_scores,
    representatives,
)
from rigidimeter.analysis.traces.over_frequency import (
    Response,
    Spectrum,
    responses,
    unexplained_spectra,
)
from rigidimeter.analysis.traces.over_time import (
    ChannelFacts,
    EpochTrace,
    channel_facts,
    epoch_traces,
)
