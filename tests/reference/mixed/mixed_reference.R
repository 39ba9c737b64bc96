# Linear mixed models of invented scores: unbalanced, three conditions, nested and crossed groups.
# Run beside scores.csv: Rscript mixed_reference.R > r_reference.csv
suppressMessages({library(lme4); library(lmerTest); library(pbkrtest)})
all <- read.csv("scores.csv")
random <- list(unbalanced="(1|examiner)", three="(1|examiner)", nested="(1|subject)+(1|subject:day)",
               no_days="(1|subject)+(1|subject:day)", crossed="(1|examiner)+(1|subject)",
               days="(1|examiner)+(1|day)", days_of_both="(1|examiner)+(1|day)+(1|day:condition)")
cat("dataset,quantity,value\n")
tight <- lmerControl(optimizer="bobyqa", optCtrl=list(rhoend=1e-12, maxfun=1e6),
                     check.conv.singular=.makeCC(action="ignore", tol=1e-4))
for (ds in names(random)) {
  d <- all[all$dataset==ds,]
  d$condition <- factor(d$condition, levels=unique(d$condition))
  emit <- function(key, value) cat(sprintf("%s,%s,%.15g\n", ds, key, value))
  m <- lmerTest::lmer(as.formula(paste("score ~ 0 + condition +", random[[ds]])), d, REML=TRUE, control=tight)
  levels <- levels(d$condition); p <- length(levels); n <- nrow(d)
  for (c in levels) emit(paste0("mean_", c), fixef(m)[[paste0("condition", c)]])
  v <- as.data.frame(VarCorr(m))
  for (k in seq_len(nrow(v))) emit(paste0("variance_", sub(":", "/", v$grp[k])), v$vcov[k])
  emit("deviance", REMLcrit(m))
  for (g in names(ranef(m))) { b <- ranef(m)[[g]]
    for (e in rownames(b)) emit(paste0("offset_", sub(":", "/", g), "_", sub(":", "/", e)), b[e,1]) }
  for (i in seq_len(p-1)) for (j in (i+1):p) {
    L <- rep(0,p); L[i] <- 1; L[j] <- -1; pair <- paste0(levels[i], "-", levels[j])
    s <- contest1D(m, L, ddf="Satterthwaite"); k <- KRmodcomp(m, matrix(L,1))$test
    emit(paste0("estimate_", pair), s[["Estimate"]]); emit(paste0("se_", pair), s[["Std. Error"]])
    emit(paste0("df_satterthwaite_", pair), s[["df"]]); emit(paste0("p_satterthwaite_", pair), s[["Pr(>|t|)"]])
    emit(paste0("f_kenward_roger_", pair), k["Ftest","stat"]); emit(paste0("df_kenward_roger_", pair), k["Ftest","ddf"])
    emit(paste0("p_kenward_roger_", pair), k["Ftest","p.value"])
    emit(paste0("p_residual_", pair), pf((s[["Estimate"]]/s[["Std. Error"]])^2, 1, n-p, lower.tail=FALSE))
  }
  L <- diff(diag(p)); L <- matrix(-L, p-1)
  s <- contestMD(m, L, ddf="Satterthwaite"); k <- KRmodcomp(m, L)$test
  emit("joint_f", s[["F value"]]); emit("joint_df_satterthwaite", s[["DenDF"]]); emit("joint_p_satterthwaite", s[["Pr(>F)"]])
  emit("joint_f_kenward_roger", k["Ftest","stat"]); emit("joint_df_kenward_roger", k["Ftest","ddf"])
}
