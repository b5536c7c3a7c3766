"""The joint belief over all robots and the target: motion models, observation models, EKF."""
