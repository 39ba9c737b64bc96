"""What is asked of one recording: its estimates, their precision, a model of its torque.

Acquisition and analysis meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.analysis.recording.estimates import estimate
from rigidimeter.analysis.recording.fitted_terms import FittedTerms, fit_terms
from rigidimeter.analysis.recording.origin import provenance, study_provenance
from rigidimeter.analysis.recording.precision import (
    OF_SCORES,
    condition_precisions,
    split_pooled,
)
from rigidimeter.analysis.recording.subject_torque_table import (
    check_name,
    subject_torque,
    write_subject_torque,
)
from rigidimeter.analysis.recording.torque_models import ModelledEpoch, model_document
