from tests.small_study import edit, fitted_study, scored_study, study

__all__ = ["edit", "fitted_study", "scored_study", "study"]
